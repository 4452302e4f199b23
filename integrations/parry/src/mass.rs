//! The mass of a scan in the frame of its shape.

use parry3d::mass_properties::MassProperties;
use parry3d::math::{Mat3, Real};

use nearmiss::{Pose, SolidMoments};

use crate::convert::{from_vector, to_pose, to_real, to_vector};

/// Mass properties of a solid of density one. The centre of mass is in double precision, because the
/// coordinates of a survey may be large until its scan is placed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mass {
    centre: [f64; 3],
    /// The centre of mass in here is ignored.
    about_centre: MassProperties,
}

impl Mass {
    /// The mass properties of a solid with these moments.
    pub(crate) fn of(moments: &SolidMoments) -> Self {
        let [x, y, z] = moments.inertia.map(to_vector);
        let inertia = Mat3::from_cols(x, y, z);
        let centre = to_vector(moments.centre);
        let about_centre = MassProperties::with_inertia_matrix(centre, to_real(moments.volume), inertia);
        Self { centre: moments.centre, about_centre }
    }

    /// The mass properties of the solid after `pose` has moved and scaled it. The density stays one: the
    /// mass grows by the cube of the scale, the inertia by its fifth power. Returns no mass if the pose is
    /// invalid.
    pub(crate) fn moved(&self, pose: &Pose) -> Self {
        let (scale, centre) = (pose.scale(), pose.apply(self.centre));
        if !(scale > 0.0 && scale.is_finite() && centre.iter().all(|c| c.is_finite())) {
            return Self::default();
        }
        let shrunk = |inverse: Real, power: i32| to_real(f64::from(inverse) / scale.powi(power));
        let mut about_centre = self.about_centre;
        about_centre.inv_mass = shrunk(about_centre.inv_mass, 3);
        about_centre.inv_principal_inertia = about_centre.inv_principal_inertia.map(|it| shrunk(it, 5));
        about_centre.principal_inertia_local_frame =
            to_pose(pose).rotation * about_centre.principal_inertia_local_frame;
        Self { centre, about_centre }
    }

    /// The mass properties of the solid with another density.
    pub(crate) fn with_density(&self, density: Real) -> MassProperties {
        let mut scaled = MassProperties { local_com: to_vector(self.centre), ..self.about_centre };
        scaled.set_mass(scaled.mass() * density, true);
        scaled
    }
}

impl From<MassProperties> for Mass {
    fn from(of_density_one: MassProperties) -> Self {
        Self { centre: from_vector(of_density_one.local_com), about_centre: of_density_one }
    }
}
