/* nearmiss: collision, contact, clearance and distance of scanned objects. */

#ifndef NEARMISS_H
#define NEARMISS_H

/* Made from the sources by cbindgen: NEARMISS_WRITE_HEADER=1 cargo test -p nearmiss-c */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 The version of this header. That of the library must be the same: see `nearmiss_version`.
 */
#define NEARMISS_VERSION "0.1.0"
#define NEARMISS_VERSION_MAJOR 0
#define NEARMISS_VERSION_MINOR 1
#define NEARMISS_VERSION_PATCH 0

/*
 The outcome of a function. `nearmiss_last_error` tells more about all but OK.
 */
enum NearmissStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     It worked, whatever the verdict.
     */
    NEARMISS_STATUS_OK = 0,
    /*
     A pointer is null that must not be.
     */
    NEARMISS_STATUS_NULL = 1,
    /*
     A handle is of another kind, was freed, or is no handle.
     */
    NEARMISS_STATUS_HANDLE = 2,
    /*
     An argument is out of range, NaN, or of the wrong size.
     */
    NEARMISS_STATUS_ARGUMENT = 3,
    /*
     The system could not read or write a file.
     */
    NEARMISS_STATUS_IO = 4,
    /*
     Data are damaged, of another version, or no scan or map.
     */
    NEARMISS_STATUS_DATA = 5,
    /*
     A fault of the library. Please report it.
     */
    NEARMISS_STATUS_FAULT = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissStatus NearmissStatus;
#else
typedef int32_t NearmissStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A verdict.
 */
enum NearmissVerdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     The question could not be decided; see the reason.
     */
    NEARMISS_VERDICT_UNDECIDED = -1,
    /*
     They are apart; of a motion: it is free.
     */
    NEARMISS_VERDICT_SEPARATED = 0,
    /*
     They touch; of a motion: it ends in an impact.
     */
    NEARMISS_VERDICT_TOUCHING = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissVerdict NearmissVerdict;
#else
typedef int32_t NearmissVerdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The certainty of an answer.
 */
enum NearmissEvidence
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     There is no verdict.
     */
    NEARMISS_EVIDENCE_NONE = -1,
    /*
     The search was complete, but proves nothing.
     */
    NEARMISS_EVIDENCE_ESTIMATED = 0,
    /*
     Proven.
     */
    NEARMISS_EVIDENCE_CERTIFIED = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissEvidence NearmissEvidence;
#else
typedef int32_t NearmissEvidence;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The reason of an undecided verdict.
 */
enum NearmissReason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     It is decided.
     */
    NEARMISS_REASON_NONE = 0,
    /*
     The budget was spent.
     */
    NEARMISS_REASON_BUDGET = 1,
    /*
     The points of one are on lines or too sparse where they come near each other.
     */
    NEARMISS_REASON_UNDERSAMPLED = 2,
    /*
     The points of one do not fit a single sheet there.
     */
    NEARMISS_REASON_AMBIGUOUS = 3,
    /*
     A pose is out of range.
     */
    NEARMISS_REASON_RANGE = 4,
    /*
     They come nearer than can be proven apart.
     */
    NEARMISS_REASON_NEAR = 5,
    /*
     Another reason.
     */
    NEARMISS_REASON_OTHER = 6,
    /*
     A shape is out of range.
     */
    NEARMISS_REASON_SHAPE = 7,
    /*
     The kernel is geodesic, so nothing is proven about a motion.
     */
    NEARMISS_REASON_GEODESIC = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissReason NearmissReason;
#else
typedef int32_t NearmissReason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How the bytes of a prepared scan or mesh are checked.
 */
enum NearmissChecks
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     Checksums and every number.
     */
    NEARMISS_CHECKS_FULL = 0,
    /*
     The layout, for files from a trusted source; takes the same time for any size.
     */
    NEARMISS_CHECKS_STRUCTURE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissChecks NearmissChecks;
#else
typedef int32_t NearmissChecks;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The amount of detail about contacts and hits.
 */
enum NearmissDetail
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     Accurate to first order. Fastest.
     */
    NEARMISS_DETAIL_VERDICT = 0,
    /*
     Points on the surfaces, verified if possible.
     */
    NEARMISS_DETAIL_WITNESS = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissDetail NearmissDetail;
#else
typedef int32_t NearmissDetail;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The meaning of "meet".
 */
enum NearmissSemantics
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     Surfaces where points sample a sheet, balls elsewhere, and every measured point.
     */
    NEARMISS_SEMANTICS_OBSTACLE = 0,
    /*
     Surfaces alone.
     */
    NEARMISS_SEMANTICS_SURFACE = 1,
    /*
     Balls of radius `thickness` about the points.
     */
    NEARMISS_SEMANTICS_THICKENED = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissSemantics NearmissSemantics;
#else
typedef int32_t NearmissSemantics;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The kind of a shape.
 */
enum NearmissShapeKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     A ball about `corners[0]`.
     */
    NEARMISS_SHAPE_KIND_SPHERE = 0,
    /*
     All points within `radius` of the segment from `corners[0]` to `corners[1]`.
     */
    NEARMISS_SHAPE_KIND_CAPSULE = 1,
    /*
     A box about the origin of `pose` with half sides `half`.
     */
    NEARMISS_SHAPE_KIND_BOX = 2,
    /*
     A cylinder about the axis y of `pose`, of half height `half[1]`.
     */
    NEARMISS_SHAPE_KIND_CYLINDER = 3,
    /*
     A cone about the axis y of `pose`, of half height `half[1]`, with its tip upwards.
     */
    NEARMISS_SHAPE_KIND_CONE = 4,
    /*
     The triangle `corners`.
     */
    NEARMISS_SHAPE_KIND_TRIANGLE = 5,
    /*
     The convex hull of `points`.
     */
    NEARMISS_SHAPE_KIND_HULL = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissShapeKind NearmissShapeKind;
#else
typedef int32_t NearmissShapeKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The scans whose surface encloses a solid. What is inside a solid overlaps it; other scans are surfaces
 without inside, such as rooms.
 */
enum NearmissSolids
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     None.
     */
    NEARMISS_SOLIDS_NONE = 0,
    /*
     The first scan, or the only one.
     */
    NEARMISS_SOLIDS_A = 1,
    /*
     The second scan.
     */
    NEARMISS_SOLIDS_B = 2,
    /*
     Both scans.
     */
    NEARMISS_SOLIDS_BOTH = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum NearmissSolids NearmissSolids;
#else
typedef int32_t NearmissSolids;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The findings of the last question about a pair of scans. Keep one for each pair whose poses
 change little between questions. It never changes a verdict, except one that a budget ends.
 */
typedef struct NearmissHint NearmissHint;

/*
 A prepared triangle mesh, for worlds (`nearmiss_world_insert_mesh`). Any number of threads may use one at
 the same time.
 */
typedef struct NearmissMesh NearmissMesh;

/*
 A motion through poses. Any number of threads may use one at the same time.
 */
typedef struct NearmissMotion NearmissMotion;

/*
 Validated options. A plan serves every question, about any scans prepared in the same way as
 those that it was made for, in any poses. Any number of threads may use one at the same time.
 */
typedef struct NearmissPlan NearmissPlan;

/*
 A prepared scan. Any number of threads may use one at the same time.
 */
typedef struct NearmissScan NearmissScan;

/*
 Working memory of questions. Make one for each thread, and reuse it: a question does not
 allocate once its scratch is warm. It serves every question and never changes an answer.
 */
typedef struct NearmissScratch NearmissScratch;

/*
 The contacts of a shape and a scan in the last frame. Keep one for each pair: contacts keep
 their ids, and the shape its side of a surface.
 */
typedef struct NearmissShapeHint NearmissShapeHint;

/*
 A building as a stack of images. Any number of threads may use one at the same time.
 */
typedef struct NearmissSliceMap NearmissSliceMap;

/*
 An avatar somewhere in a map.
 */
typedef struct NearmissWalker NearmissWalker;

/*
 Placed scans, meshes and convex shapes, each a body with an id. Any number of threads may ask at the same
 time, while none changes it.
 */
typedef struct NearmissWorld NearmissWorld;

/*
 A pose: world = scale · rotation · object + translation.
 */
typedef struct NearmissPose {
    /*
     The position of the object's origin in the world.
     */
    double translation[3];
    /*
     The rotation as a quaternion x, y, z, w of any length but 0.
     */
    double rotation[4];
    /*
     The uniform scale, above 0.
     */
    double scale;
} NearmissPose;

/*
 Facts about a mesh. Lengths are in the units of its input.
 */
typedef struct NearmissMeshAbout {
    /*
     The number of triangles.
     */
    uint64_t triangles;
    /*
     The number of vertices.
     */
    uint64_t vertices;
    /*
     The least corner of the bounds.
     */
    double min[3];
    /*
     The greatest corner of the bounds.
     */
    double max[3];
    /*
     True if a part of the mesh is closed, and counts as solid in `nearmiss_world_penetration`.
     */
    bool is_closed;
    /*
     The input triangles that were dropped, as they have no area.
     */
    uint64_t degenerate;
    /*
     The input triangles that were dropped, as they repeat others.
     */
    uint64_t duplicate;
    /*
     The input vertices that were welded to others.
     */
    uint64_t welded;
} NearmissMeshAbout;

/*
 How a scan is prepared. Start from `nearmiss_prepare_options`.
 */
typedef struct NearmissPrepareOptions {
    /*
     The widest gap that is bridged, a length; 0 to estimate it.
     */
    double reach;
    /*
     A point's spacing is the distance of this neighbour: 3 to 32, 6 by default.
     */
    uint32_t radius_neighbours;
    /*
     Not 0: points that are not finite are dropped; otherwise they are refused.
     */
    int32_t drop_invalid;
    /*
     Not 0: a graph over the points turns the normals outwards. Takes as long again.
     */
    int32_t graph;
} NearmissPrepareOptions;

/*
 Facts about a scan. Lengths are in the units of its input.
 */
typedef struct NearmissScanAbout {
    /*
     The number of points.
     */
    uint64_t points;
    /*
     The least corner of the bounds of the points. The obstacle, and so a hit of a ray, may exceed them
     by up to `reach`.
     */
    double min[3];
    /*
     The greatest corner of the bounds.
     */
    double max[3];
    /*
     The 0.9-quantile of the local radii.
     */
    double sampling_radius;
    /*
     The widest gap that is bridged.
     */
    double reach;
    /*
     The input points that were dropped, as they were not finite.
     */
    uint64_t not_finite;
    /*
     The input points that were dropped, as they repeat others.
     */
    uint64_t duplicate;
    /*
     True if the normals point outwards.
     */
    bool is_oriented;
} NearmissScanAbout;

/*
 Options of a plan. Start from `nearmiss_options`. Lengths are in world units.
 */
typedef struct NearmissOptions {
    /*
     A `NearmissSemantics`.
     */
    int32_t semantics;
    /*
     The wanted `NearmissEvidence` of separations.
     */
    int32_t evidence;
    /*
     A `NearmissDetail`.
     */
    int32_t detail;
    /*
     The radius of balls with `NEARMISS_SEMANTICS_THICKENED`.
     */
    double thickness;
    /*
     Nearer than this counts as touching; of a sweep, the distance to keep.
     */
    double margin;
    /*
     The share of the upper bound of a distance by which the lower one may stay below it.
     */
    double relative;
} NearmissOptions;

/*
 Limits of a question, which ends at the first one it reaches. Start from `nearmiss_unlimited`.
 */
typedef struct NearmissBudget {
    /*
     Units of work: evaluations and node pairs. Reproducible. `UINT64_MAX` for no limit.
     */
    uint64_t work;
    /*
     Seconds from the start of the question. Infinite for no limit.
     */
    double seconds;
} NearmissBudget;

/*
 A scan at a pose in the world.
 */
typedef struct NearmissPlaced {
    /*
     The scan.
     */
    const struct NearmissScan *scan;
    /*
     Maps the frame of the scan's input to the world.
     */
    struct NearmissPose pose;
} NearmissPlaced;

/*
 An answer. Missing numbers are NaN, missing points `UINT32_MAX`. World coordinates and lengths.
 */
typedef struct NearmissAnswer {
    /*
     The verdict.
     */
    NearmissVerdict verdict;
    /*
     The certainty of the verdict.
     */
    NearmissEvidence evidence;
    /*
     The reason if it is undecided.
     */
    NearmissReason reason;
    /*
     The point of the first scan that shows the contact, as the input numbers it; the triangle of a mesh.
     */
    uint32_t source_a;
    /*
     The point of the second scan, or the triangle of a mesh.
     */
    uint32_t source_b;
    /*
     A place where both touch.
     */
    double witness[3];
    /*
     The unit normal of the first surface there, of either sign; missing if points are compared.
     */
    double normal_a[3];
    /*
     The unit normal of the second surface there.
     */
    double normal_b[3];
    /*
     The uncertainty of the place.
     */
    double residual;
    /*
     A proven lower bound of the distance, of a certified separation.
     */
    double gap;
    /*
     The length within which nothing is claimed about the scanned things themselves. Infinite if a pose or
     a shape is out of range.
     */
    double band;
    /*
     The probability of a contact, if the budget was spent.
     */
    double likelihood;
    /*
     The work that was done: evaluations of surfaces.
     */
    uint64_t evaluations;
    /*
     The work that was done: pairs of nodes.
     */
    uint64_t node_pairs;
    /*
     The work that was done: pairs of leaves.
     */
    uint64_t leaf_pairs;
} NearmissAnswer;

/*
 A contact point for a physics solver, in the world.
 */
typedef struct NearmissManifoldPoint {
    /*
     The point midway between the surfaces.
     */
    double point[3];
    /*
     The unit direction in which the first scan moves out of the second.
     */
    double normal[3];
    /*
     The distance along the normal; negative for penetration.
     */
    double gap;
    /*
     The nearest point of the first scan, as the input numbers it.
     */
    uint32_t source_a;
    /*
     The nearest point of the second scan.
     */
    uint32_t source_b;
} NearmissManifoldPoint;

/*
 The places for a list, and the number of entries there are. Fields that are written need no value before.
 */
typedef struct NearmissManifoldList {
    /*
     Room for `capacity` points; eight suffice. May be null if `capacity` is 0.
     */
    struct NearmissManifoldPoint *points;
    /*
     The number of places.
     */
    size_t capacity;
    /*
     Written: the number of points, which may exceed the capacity. The first ones are written.
     */
    size_t count;
} NearmissManifoldList;

/*
 A contact of two scans, in the world.
 */
typedef struct NearmissContact {
    /*
     The place.
     */
    double point[3];
    /*
     The unit normal of the first surface there, of either sign; NaN if points are compared.
     */
    double normal_a[3];
    /*
     The unit normal of the second surface there.
     */
    double normal_b[3];
    /*
     The uncertainty of the place.
     */
    double residual;
    /*
     The point of the first scan, as the input numbers it.
     */
    uint32_t source_a;
    /*
     The point of the second scan.
     */
    uint32_t source_b;
} NearmissContact;

/*
 The places for a list, and the number of entries there are. Fields that are written need no value before.
 */
typedef struct NearmissContactList {
    /*
     Room for `capacity` contacts. May be null if `capacity` is 0.
     */
    struct NearmissContact *contacts;
    /*
     The number of places.
     */
    size_t capacity;
    /*
     Written: the number of contacts, which may exceed the capacity. The first ones are written.
     */
    size_t count;
    /*
     Written: true if the budget did not end the search, so that the list has all contacts.
     */
    bool complete;
} NearmissContactList;

/*
 Bounds on a distance, in world units: lower ≤ distance ≤ upper. If a pose is out of range, `lower` is 0,
 `upper` and `band` are infinite, the places NaN and the points `UINT32_MAX`.
 */
typedef struct NearmissDistance {
    /*
     A proven lower bound; 0 if nothing is known.
     */
    double lower;
    /*
     An upper bound: the distance of the two places; infinite if nothing is known.
     */
    double upper;
    /*
     The nearest place on the first scan.
     */
    double point_a[3];
    /*
     The nearest place on the second scan.
     */
    double point_b[3];
    /*
     The length within which nothing is claimed about the scanned things themselves.
     */
    double band;
    /*
     The point of the first scan near its place, as the input numbers it.
     */
    uint32_t source_a;
    /*
     The point of the second scan near its place.
     */
    uint32_t source_b;
    /*
     The certainty of the upper bound; none if it is infinite.
     */
    NearmissEvidence evidence;
    /*
     True if the budget did not end the search.
     */
    bool complete;
} NearmissDistance;

/*
 A convex shape in the world. Make it with `nearmiss_sphere` and the like.
 */
typedef struct NearmissShape {
    /*
     A `NearmissShapeKind`.
     */
    int32_t kind;
    /*
     The pose of a box, a cylinder or a cone.
     */
    struct NearmissPose pose;
    /*
     Half sides or the half height.
     */
    double half[3];
    /*
     The radius of a sphere, a capsule, a cylinder or a cone.
     */
    double radius;
    /*
     The length by which a box, cylinder, cone, triangle or hull is grown in all directions.
     */
    double rounding;
    /*
     The centre, ends or corners.
     */
    double corners[3][3];
    /*
     The points of a hull, three numbers each, which stay valid as long as the shape is used.
     */
    const double *points;
    /*
     The number of points of a hull.
     */
    size_t point_count;
} NearmissShape;

/*
 The answer about a shape. Missing numbers are NaN, a missing point `UINT32_MAX`.
 */
typedef struct NearmissShapeAnswer {
    /*
     The verdict.
     */
    NearmissVerdict verdict;
    /*
     The certainty of the verdict.
     */
    NearmissEvidence evidence;
    /*
     The reason if it is undecided.
     */
    NearmissReason reason;
    /*
     The point whose disc or ball the shape touches, as the input numbers it.
     */
    uint32_t source;
    /*
     A place of the scan in the shape.
     */
    double point[3];
    /*
     The length within which nothing is claimed about the scanned thing itself.
     */
    double band;
} NearmissShapeAnswer;

/*
 Bounds on the distance of a shape and a scan: lower ≤ distance ≤ upper. If no disc or ball of the scan is
 within the greatest distance asked for, or if a pose or the shape is out of range, `upper` is infinite,
 places and `band` are NaN, and `source` is `UINT32_MAX`.
 */
typedef struct NearmissShapeDistance {
    /*
     A proven lower bound. At most the distance asked for if `upper` is infinite; 0 if nothing is known.
     */
    double lower;
    /*
     An upper bound: the distance of the two places.
     */
    double upper;
    /*
     The nearest place on the scan.
     */
    double point[3];
    /*
     The nearest place on the shape.
     */
    double point_of_shape[3];
    /*
     The local radius of the nearest point.
     */
    double band;
    /*
     The nearest point, as the input numbers it.
     */
    uint32_t source;
    /*
     The certainty of the upper bound; none if it is infinite.
     */
    NearmissEvidence evidence;
} NearmissShapeDistance;

/*
 A contact of a shape with a scan, for a physics solver.
 */
typedef struct NearmissShapeContact {
    /*
     A point of the surface.
     */
    double point[3];
    /*
     The unit direction in which the shape moves out.
     */
    double normal[3];
    /*
     The depth along the normal; negative for a gap within the margin.
     */
    double depth;
    /*
     A number that the contact keeps from frame to frame with a hint.
     */
    uint64_t id;
} NearmissShapeContact;

/*
 A ray, or a ball that moves along it.
 */
typedef struct NearmissRay {
    /*
     The start.
     */
    double origin[3];
    /*
     The direction, of any length but 0.
     */
    double direction[3];
    /*
     The greatest length; infinite for a ray without end.
     */
    double max;
    /*
     The radius of the ball; 0 for a ray.
     */
    double radius;
} NearmissRay;

/*
 The answer about a ray. Missing numbers are NaN, a missing point `UINT32_MAX`.
 */
typedef struct NearmissRayHit {
    /*
     True if it hits anything.
     */
    bool hit;
    /*
     The certainty of the hit, or of none.
     */
    NearmissEvidence evidence;
    /*
     The point whose disc or ball is hit, as the input numbers it.
     */
    uint32_t source;
    /*
     The length from the origin.
     */
    double t;
    /*
     The place.
     */
    double point[3];
    /*
     The unit normal there.
     */
    double normal[3];
} NearmissRayHit;

/*
 Bounds on the least shift that separates two things, in world units: lower ≤ length ≤ upper.
 */
typedef struct NearmissPenetration {
    /*
     A lower bound: every shorter shift leaves a contact or an overlap. 0 if no bound was found.
     */
    double lower;
    /*
     The length of a shift that separates the two: 0 if they already are separate, infinite if a pose or a
     shape is out of range or if no such shift was found.
     */
    double upper;
    /*
     The unit direction of that shift; 0 if none is needed or known.
     */
    double direction[3];
    /*
     The length within which nothing is claimed about the scanned things themselves.
     */
    double band;
    /*
     The certainty of the separation after that shift; none if there is no such shift.
     */
    NearmissEvidence evidence;
    /*
     True if the budget did not end the search.
     */
    bool complete;
} NearmissPenetration;

/*
 A field of a ROS `PointField`.
 */
typedef struct NearmissMessageField {
    /*
     The name, such as "x".
     */
    const char *name;
    /*
     The offset in a point, in bytes.
     */
    uint32_t offset;
    /*
     The type: 1 to 8 for int8, uint8, int16, uint16, int32, uint32, float32 and float64.
     */
    uint8_t datatype;
    /*
     The number of numbers.
     */
    uint32_t count;
} NearmissMessageField;

/*
 The contents of a ROS `PointCloud2`. Nothing is copied.
 */
typedef struct NearmissMessage {
    /*
     The number of rows.
     */
    uint32_t height;
    /*
     The number of points in a row.
     */
    uint32_t width;
    /*
     The fields of a point.
     */
    const struct NearmissMessageField *fields;
    /*
     The number of fields.
     */
    size_t field_count;
    /*
     Not 0 if numbers are big endian.
     */
    int32_t is_bigendian;
    /*
     The bytes from one point to the next.
     */
    uint32_t point_step;
    /*
     The bytes from one row to the next.
     */
    uint32_t row_step;
    /*
     The points.
     */
    const uint8_t *data;
    /*
     The number of bytes of the points.
     */
    size_t data_length;
} NearmissMessage;

/*
 The answer about a motion. Missing numbers are NaN. Times count poses, with fractions.
 */
typedef struct NearmissSweepAnswer {
    /*
     Separated: free at all times. Touching: an impact.
     */
    NearmissVerdict verdict;
    /*
     The certainty of the verdict; none for the impact of a shape.
     */
    NearmissEvidence evidence;
    /*
     The reason if it is undecided.
     */
    NearmissReason reason;
    /*
     The motion is proven free up to this time.
     */
    double t_free;
    /*
     The time of the impact.
     */
    double t_hit;
    /*
     The place of the impact.
     */
    double witness[3];
    /*
     A proven distance that a free motion always keeps.
     */
    double clearance;
    /*
     The least upper bound of the distance that was found.
     */
    double upper;
    /*
     The time at which they come nearest, as far as known.
     */
    double nearest_at;
    /*
     The length within which nothing is claimed about the scanned things themselves.
     */
    double band;
} NearmissSweepAnswer;

/*
 How a map is built. Start from `nearmiss_map_options`. Lengths are in the units of the points.
 */
typedef struct NearmissMapOptions {
    /*
     The side of a pixel; 0 for 700 pixels along the longer side.
     */
    double pixel;
    /*
     The height of a slice; 0 for three pixels.
     */
    double slice_height;
    /*
     Steeper than this, in degrees, is an obstacle.
     */
    double max_slope;
    /*
     The height that a level floor spans; negative to estimate it.
     */
    double noise;
    /*
     The axis that points up: "x", "y", "z", "-x", "-y" or "-z". Null for z.
     */
    const char *up;
} NearmissMapOptions;

/*
 The content of a box.
 */
typedef struct NearmissOccupancy {
    /*
     True if anything is in the box.
     */
    bool collides;
    /*
     True if an obstacle is in the box.
     */
    bool obstacle;
    /*
     The number of occupied pixels.
     */
    uint64_t pixels;
    /*
     The height of the floor below the box; NaN if there is none.
     */
    double floor;
} NearmissOccupancy;

/*
 The size of an avatar. Start from `nearmiss_avatar`.
 */
typedef struct NearmissAvatar {
    /*
     The width and depth of its base.
     */
    double base[2];
    /*
     Its height.
     */
    double height;
    /*
     The height that it steps up at once.
     */
    double climb;
    /*
     The distance of a step.
     */
    double step;
} NearmissAvatar;

/*
 The result of a step.
 */
typedef struct NearmissStep {
    /*
     The place of the feet.
     */
    double position[3];
    /*
     True if something was in the way.
     */
    bool blocked;
    /*
     True if it fell, or is about to fall.
     */
    bool falling;
} NearmissStep;

/*
 The ids of two bodies, the smaller one first.
 */
typedef struct NearmissBodyPair {
    /*
     The smaller id.
     */
    uint64_t a;
    /*
     The greater id.
     */
    uint64_t b;
} NearmissBodyPair;

/*
 Bounds on the distance of two bodies: lower ≤ distance ≤ upper. If it is not known, `lower` is 0, `upper`
 infinite, and the places are NaN.
 */
typedef struct NearmissBodyDistance {
    /*
     The ids of the bodies: in the order of the caller, or for a nearest pair the smaller one first. Both
     are `UINT64_MAX` if no pair counts.
     */
    struct NearmissBodyPair pair;
    /*
     A proven lower bound; 0 if nothing is known.
     */
    double lower;
    /*
     An upper bound: the distance of the two places. 0 if the bodies touch; infinite if nothing is known.
     */
    double upper;
    /*
     The nearest place on the first body.
     */
    double point_a[3];
    /*
     The nearest place on the second body.
     */
    double point_b[3];
    /*
     The certainty of the upper bound; none if it is infinite. Estimated for a scan and a shape, and for a
     nearest pair with a scan.
     */
    NearmissEvidence evidence;
    /*
     True if the budget did not end the search; false if nothing is known.
     */
    bool complete;
} NearmissBodyDistance;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Returns the message of the last function that failed on this thread; empty if none did.

 The text is UTF-8 and valid until the next failure on this thread. Thread safety: any thread.
 */
const char *nearmiss_last_error(void);

/*
 Returns the version of the library, such as "0.1.0". Compare it with `NEARMISS_VERSION`, which is that of
 the header, before the first other call: structs may differ between versions. Thread safety: any thread.
 */
const char *nearmiss_version(void);

/*
 Returns the identity. Thread safety: any thread.
 */
struct NearmissPose nearmiss_pose_identity(void);

/*
 Makes the pose of a row-major 4×4 matrix, whose linear part is a rotation with uniform scale up to
 the rounding of single precision. Thread safety: any thread.
 */
NearmissStatus nearmiss_pose_from_matrix(const double (*matrix)[16], struct NearmissPose *out);

/*
 Prepares `triangle_count` triangles, three indices of vertices each, over `vertex_count` vertices, three
 numbers each, and writes the handle to `out`. Vertices within `weld` of each other become one; 0 welds
 those at the same place. Takes about 50 ms for 100,000 triangles on two cores. Thread safety: any thread.

 # Safety
 `vertices` are `3 · vertex_count` numbers, `triangles` are `3 · triangle_count`; `out` is null or valid.
 */
NearmissStatus nearmiss_mesh_from_triangles(const double *vertices,
                                            size_t vertex_count,
                                            const uint32_t *triangles,
                                            size_t triangle_count,
                                            double weld,
                                            struct NearmissMesh **out);

/*
 Reads and prepares the triangles of a file: PLY, OBJ, STL, OFF or glTF. `weld` is that of
 `nearmiss_mesh_from_triangles`. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; `out` is null or valid.
 */
NearmissStatus nearmiss_mesh_read(const char *file, double weld, struct NearmissMesh **out);

/*
 Opens a prepared file by mapping it; `checks` is a `NearmissChecks`. The file must not be changed in
 place while it is open; saving over it is fine. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; `out` is null or valid.
 */
NearmissStatus nearmiss_mesh_open(const char *file,
                                  int32_t checks,
                                  struct NearmissMesh **out);

/*
 Loads a mesh from the bytes of a prepared file, which are copied; `checks` is a `NearmissChecks`.
 Thread safety: any thread.

 # Safety
 `bytes` are `length` bytes; `out` is null or valid.
 */
NearmissStatus nearmiss_mesh_from_bytes(const uint8_t *bytes,
                                        size_t length,
                                        int32_t checks,
                                        struct NearmissMesh **out);

/*
 Saves a mesh to a prepared file, atomically. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; `mesh` is null or a handle.
 */
NearmissStatus nearmiss_mesh_save(const struct NearmissMesh *mesh, const char *file);

/*
 Writes the bytes of a prepared file to `buffer`, as many as its capacity holds, and their whole
 number to `length`. Ask with a capacity of 0 first. Thread safety: any thread.

 # Safety
 `buffer` are `capacity` bytes that nothing else uses; other pointers are null or valid.
 */
NearmissStatus nearmiss_mesh_to_bytes(const struct NearmissMesh *mesh,
                                      uint8_t *buffer,
                                      size_t capacity,
                                      size_t *length);

/*
 Writes facts about a mesh to `out`. The first call finds the closed parts, in 20 ms for 100,000 triangles.
 Thread safety: any thread.
 */
NearmissStatus nearmiss_mesh_about(const struct NearmissMesh *mesh,
                                   struct NearmissMeshAbout *out);

/*
 Frees a mesh; null is fine. Worlds keep the meshes that were inserted. Thread safety: no other call may
 use the handle at the same time or later.

 # Safety
 `mesh` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_mesh_free(struct NearmissMesh *mesh);

/*
 Returns the default options. Thread safety: any thread.
 */
struct NearmissPrepareOptions nearmiss_prepare_options(void);

/*
 Prepares `count` points, three numbers each, and writes the handle to `out`. `options` may be null.
 Takes about 1.5 s for a million points on two cores. Thread safety: any thread.

 # Safety
 `points` are `3 · count` numbers, and all pointers are null or valid.
 */
NearmissStatus nearmiss_scan_from_points(const double *points,
                                         size_t count,
                                         const struct NearmissPrepareOptions *options,
                                         struct NearmissScan **out);

/*
 Like `nearmiss_scan_from_points`, with numbers in single precision. Thread safety: any thread.

 # Safety
 As for `nearmiss_scan_from_points`.
 */
NearmissStatus nearmiss_scan_from_floats(const float *points,
                                         size_t count,
                                         const struct NearmissPrepareOptions *options,
                                         struct NearmissScan **out);

/*
 Reads and prepares a file of points: PLY, PCD, LAS, LAZ, E57, NPY, OBJ, STL, OFF, glTF or text.
 `options` may be null; invalid points are dropped. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; other pointers are null or valid.
 */
NearmissStatus nearmiss_scan_read(const char *file,
                                  const struct NearmissPrepareOptions *options,
                                  struct NearmissScan **out);

/*
 Opens a prepared file by mapping it; `checks` is a `NearmissChecks`. The file must not be changed in
 place while it is open; saving over it is fine. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; `out` is null or valid.
 */
NearmissStatus nearmiss_scan_open(const char *file,
                                  int32_t checks,
                                  struct NearmissScan **out);

/*
 Loads a scan from the bytes of a prepared file, which are copied; `checks` is a `NearmissChecks`.
 Thread safety: any thread.

 # Safety
 `bytes` are `length` bytes; `out` is null or valid.
 */
NearmissStatus nearmiss_scan_from_bytes(const uint8_t *bytes,
                                        size_t length,
                                        int32_t checks,
                                        struct NearmissScan **out);

/*
 Saves a scan to a prepared file, atomically. Thread safety: any thread.

 # Safety
 `file` is null or text that ends with a zero byte; `scan` is null or a handle.
 */
NearmissStatus nearmiss_scan_save(const struct NearmissScan *scan, const char *file);

/*
 Writes the bytes of a prepared file to `buffer`, as many as its capacity holds, and their whole
 number to `length`. Ask with a capacity of 0 first. Thread safety: any thread.

 # Safety
 `buffer` are `capacity` bytes that nothing else uses; other pointers are null or valid.
 */
NearmissStatus nearmiss_scan_to_bytes(const struct NearmissScan *scan,
                                      uint8_t *buffer,
                                      size_t capacity,
                                      size_t *length);

/*
 Writes facts about a scan to `out`. Thread safety: any thread.
 */
NearmissStatus nearmiss_scan_about(const struct NearmissScan *scan, struct NearmissScanAbout *out);

/*
 Frees a scan; null is fine. Worlds keep the scans that were inserted. Thread safety: no other call
 may use the handle at the same time or later.

 # Safety
 `scan` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_scan_free(struct NearmissScan *scan);

/*
 Makes a hint for a pair of scans. Thread safety: any thread; later, one call at a time.
 */
NearmissStatus nearmiss_hint_new(struct NearmissHint **out);

/*
 Frees a hint; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `hint` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_hint_free(struct NearmissHint *hint);

/*
 Makes a hint for a shape and a scan. Thread safety: any thread; later, one call at a time.
 */
NearmissStatus nearmiss_shape_hint_new(struct NearmissShapeHint **out);

/*
 Forgets all contacts, as the shape was moved elsewhere. Thread safety: one call at a time.
 */
NearmissStatus nearmiss_shape_hint_clear(struct NearmissShapeHint *hint);

/*
 Frees a hint; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `hint` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_shape_hint_free(struct NearmissShapeHint *hint);

/*
 Returns the default options: obstacles, certified, with witnesses. Thread safety: any thread.
 */
struct NearmissOptions nearmiss_options(void);

/*
 Returns a budget without limits. Thread safety: any thread.
 */
struct NearmissBudget nearmiss_unlimited(void);

/*
 Validates options, for `a` and `b` and all scans prepared for the same kernel. `options` may be
 null. Both scans may be null, for a world whose scans, if any, have the default kernel. Thread safety: any
 thread.
 */
NearmissStatus nearmiss_plan_new(const struct NearmissOptions *options,
                                 const struct NearmissScan *a,
                                 const struct NearmissScan *b,
                                 struct NearmissPlan **out);

/*
 Frees a plan; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `plan` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_plan_free(struct NearmissPlan *plan);

/*
 Makes scratch memory. Thread safety: any thread; later, one call at a time.
 */
NearmissStatus nearmiss_scratch_new(struct NearmissScratch **out);

/*
 Frees scratch memory; null is fine. Thread safety: no other call may use the handle at the same time
 or later.

 # Safety
 `scratch` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_scratch_free(struct NearmissScratch *scratch);

/*
 Decides whether two scans touch. `limits` and `hint` may be null. Does not allocate once the scratch
 is warm. Thread safety: one call at a time for each scratch and each hint.
 */
NearmissStatus nearmiss_collide(const struct NearmissPlan *plan,
                                const struct NearmissPlaced *a,
                                const struct NearmissPlaced *b,
                                const struct NearmissBudget *limits,
                                struct NearmissHint *hint,
                                struct NearmissScratch *scratch,
                                struct NearmissAnswer *out);

/*
 Like `nearmiss_collide`, and writes up to eight contact points for a physics solver to `list`. The
 first is the deepest; each of the others is the candidate furthest from all earlier ones. Thread
 safety: as for `nearmiss_collide`.

 # Safety
 `list` is null or valid, and so are its places.
 */
NearmissStatus nearmiss_manifold(const struct NearmissPlan *plan,
                                 const struct NearmissPlaced *a,
                                 const struct NearmissPlaced *b,
                                 const struct NearmissBudget *limits,
                                 struct NearmissHint *hint,
                                 struct NearmissScratch *scratch,
                                 struct NearmissManifoldList *list,
                                 struct NearmissAnswer *out);

/*
 Like `nearmiss_collide` without a hint, and writes a contact of each pair of leaves that touch to
 `list`. Thread safety: as for `nearmiss_collide`.

 # Safety
 `list` is null or valid, and so are its places.
 */
NearmissStatus nearmiss_contacts(const struct NearmissPlan *plan,
                                 const struct NearmissPlaced *a,
                                 const struct NearmissPlaced *b,
                                 const struct NearmissBudget *limits,
                                 struct NearmissScratch *scratch,
                                 struct NearmissContactList *list,
                                 struct NearmissAnswer *out);

/*
 Bounds the distance of two scans. `limits` may be null. Thread safety: one call at a time for each
 scratch.
 */
NearmissStatus nearmiss_distance(const struct NearmissPlan *plan,
                                 const struct NearmissPlaced *a,
                                 const struct NearmissPlaced *b,
                                 const struct NearmissBudget *limits,
                                 struct NearmissScratch *scratch,
                                 struct NearmissDistance *out);

/*
 A ball. Thread safety: any thread.
 */
struct NearmissShape nearmiss_sphere(const double (*centre)[3], double radius);

/*
 All points within `radius` of a segment. Thread safety: any thread.
 */
struct NearmissShape nearmiss_capsule(const double (*start)[3],
                                      const double (*end)[3],
                                      double radius);

/*
 A box with these half sides about the origin of `pose`. Thread safety: any thread.
 */
struct NearmissShape nearmiss_box(struct NearmissPose pose,
                                  double half_x,
                                  double half_y,
                                  double half_z);

/*
 A cylinder about the axis y of `pose`. Thread safety: any thread.
 */
struct NearmissShape nearmiss_cylinder(struct NearmissPose pose, double half_height, double radius);

/*
 A cone about the axis y of `pose`, with its tip upwards. Thread safety: any thread.
 */
struct NearmissShape nearmiss_cone(struct NearmissPose pose, double half_height, double radius);

/*
 A triangle, grown by `rounding`. Thread safety: any thread.
 */
struct NearmissShape nearmiss_triangle(const double (*a)[3],
                                       const double (*b)[3],
                                       const double (*c)[3],
                                       double rounding);

/*
 The convex hull of `count` points of three numbers each, grown by `rounding`. The points are not
 copied: they stay valid as long as the shape is used. Thread safety: any thread.
 */
struct NearmissShape nearmiss_hull(const double *points, size_t count, double rounding);

/*
 Decides for each of `count` shapes whether it touches a scan, or comes within the margin of the
 plan, and writes `count` answers to `out`. Thread safety: one call at a time for each scratch.

 # Safety
 `shapes` and `out` are `count` values; other pointers are null or valid.
 */
NearmissStatus nearmiss_touch(const struct NearmissPlan *plan,
                              const struct NearmissPlaced *scan,
                              const struct NearmissShape *shapes,
                              size_t count,
                              struct NearmissScratch *scratch,
                              struct NearmissShapeAnswer *out);

/*
 Bounds the distance of each of `count` shapes and a scan, and writes `count` answers to `out`. No disc or
 ball further away than `within` is looked for, which saves time; infinite for no limit. Thread safety: one
 call at a time for each scratch.

 # Safety
 `shapes` and `out` are `count` values; other pointers are null or valid.
 */
NearmissStatus nearmiss_shape_distance(const struct NearmissPlan *plan,
                                       const struct NearmissPlaced *scan,
                                       const struct NearmissShape *shapes,
                                       size_t count,
                                       double within,
                                       struct NearmissScratch *scratch,
                                       struct NearmissShapeDistance *out);

/*
 Writes the contacts of a shape with a scan to `out`, as many as its capacity holds, and their number,
 at most eight, to `count`. The first is the deepest; the others are spread out, at least half a local
 radius apart. The list is empty if the pose or the shape is out of range; `nearmiss_touch` is then
 undecided. `hint` may be null. Thread safety: one call at a time for each scratch and each hint.

 # Safety
 `out` are `capacity` places; other pointers are null or valid.
 */
NearmissStatus nearmiss_shape_contacts(const struct NearmissPlan *plan,
                                       const struct NearmissPlaced *scan,
                                       const struct NearmissShape *shape,
                                       struct NearmissShapeHint *hint,
                                       struct NearmissScratch *scratch,
                                       struct NearmissShapeContact *out,
                                       size_t capacity,
                                       size_t *count);

/*
 Finds the first place where each of `count` rays hits a scan, and writes `count` answers to `out`. If the
 pose is out of range, it hits nothing, with estimated evidence. Thread safety: one call at a time for each
 scratch.

 # Safety
 `rays` and `out` are `count` values; other pointers are null or valid.
 */
NearmissStatus nearmiss_cast(const struct NearmissPlan *plan,
                             const struct NearmissPlaced *scan,
                             const struct NearmissRay *rays,
                             size_t count,
                             struct NearmissScratch *scratch,
                             struct NearmissRayHit *out);

/*
 Writes all places where a ray hits a scan to `out`, as many as its capacity holds, the nearest
 first, and their whole number to `count`. Thread safety: one call at a time for each scratch.

 # Safety
 `out` are `capacity` places; other pointers are null or valid.
 */
NearmissStatus nearmiss_cast_all(const struct NearmissPlan *plan,
                                 const struct NearmissPlaced *scan,
                                 const struct NearmissRay *ray,
                                 struct NearmissScratch *scratch,
                                 struct NearmissRayHit *out,
                                 size_t capacity,
                                 size_t *count);

/*
 Bounds how far the second scan must be moved, in any direction, to be separate from the first. `solids`
 is a `NearmissSolids`. Without solids and thickened points, the lower bound is 0. `limits` may be null.
 Takes as long as some hundred calls of `nearmiss_collide`. Thread safety: one call at a time for each
 scratch.
 */
NearmissStatus nearmiss_penetration(const struct NearmissPlan *plan,
                                    const struct NearmissPlaced *a,
                                    const struct NearmissPlaced *b,
                                    int32_t solids,
                                    const struct NearmissBudget *limits,
                                    struct NearmissScratch *scratch,
                                    struct NearmissPenetration *out);

/*
 Bounds how far a shape must be moved, in any direction, to touch nothing of a scan. `solids` is
 `NEARMISS_SOLIDS_A` if the surface of the scan encloses a solid. `limits` may be null. Takes as long as
 some hundred calls of `nearmiss_touch`. Thread safety: one call at a time for each scratch.

 # Safety
 Pointers are null or valid, that to the points of a hull too.
 */
NearmissStatus nearmiss_shape_penetration(const struct NearmissPlan *plan,
                                          const struct NearmissPlaced *scan,
                                          const struct NearmissShape *shape,
                                          int32_t solids,
                                          const struct NearmissBudget *limits,
                                          struct NearmissScratch *scratch,
                                          struct NearmissPenetration *out);

/*
 Prepares the points of a ROS `PointCloud2`, with its normals if it has any. Points that are not finite
 are dropped. `options` may be null. Thread safety: any thread.

 # Safety
 The message's fields, their names and its data are valid; other pointers are null or valid.
 */
NearmissStatus nearmiss_scan_from_point_cloud2(const struct NearmissMessage *message,
                                               const struct NearmissPrepareOptions *options,
                                               struct NearmissScan **out);

/*
 Makes the motion through `count` poses by screws; pose k is reached at time k. One pose stays.
 Thread safety: any thread.

 # Safety
 `poses` are `count` poses; `out` is null or valid.
 */
NearmissStatus nearmiss_motion_new(const struct NearmissPose *poses,
                                   size_t count,
                                   struct NearmissMotion **out);

/*
 Frees a motion; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `motion` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_motion_free(struct NearmissMotion *motion);

/*
 Proves that two scans stay apart, by more than the margin of the plan, along their motions, or
 finds the first impact. `limits` may be null. Thread safety: one call at a time for each scratch.
 */
NearmissStatus nearmiss_sweep(const struct NearmissPlan *plan,
                              const struct NearmissScan *a,
                              const struct NearmissMotion *motion_a,
                              const struct NearmissScan *b,
                              const struct NearmissMotion *motion_b,
                              const struct NearmissBudget *limits,
                              struct NearmissScratch *scratch,
                              struct NearmissSweepAnswer *out);

/*
 Proves that a shape stays clear of a scan, by more than the margin of the plan, along its motion, or
 finds the first impact. The poses of the motion map the frame of the shape to the world. Thread safety:
 one call at a time for each scratch.

 # Safety
 Pointers are null or valid, that to the points of a hull too.
 */
NearmissStatus nearmiss_shape_sweep(const struct NearmissPlan *plan,
                                    const struct NearmissPlaced *scan,
                                    const struct NearmissShape *shape,
                                    const struct NearmissMotion *motion,
                                    struct NearmissScratch *scratch,
                                    struct NearmissSweepAnswer *out);

/*
 Returns the default options: z points up, obstacles are steeper than 45 degrees. Thread safety: any
 thread.
 */
struct NearmissMapOptions nearmiss_map_options(void);

/*
 Builds a map from `count` points, three numbers each. `options` may be null. Thread safety: any
 thread.

 # Safety
 `points` are `3 · count` numbers; other pointers are null or valid.
 */
NearmissStatus nearmiss_map_from_points(const double *points,
                                        size_t count,
                                        const struct NearmissMapOptions *options,
                                        struct NearmissSliceMap **out);

/*
 Loads all slices of a folder. Thread safety: any thread.

 # Safety
 `folder` is null or text that ends with a zero byte; `out` is null or valid.
 */
NearmissStatus nearmiss_map_open(const char *folder, struct NearmissSliceMap **out);

/*
 Saves a map to a folder. Thread safety: any thread.

 # Safety
 `folder` is null or text that ends with a zero byte; `map` is null or a handle.
 */
NearmissStatus nearmiss_map_save(const struct NearmissSliceMap *map, const char *folder);

/*
 Frees a map; null is fine. Thread safety: no other call may use the handle at the same time or later.

 # Safety
 `map` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_map_free(struct NearmissSliceMap *map);

/*
 Tells what is in the box from `min` to `max`, and how high the floor below it is. Thread safety: any
 thread.
 */
NearmissStatus nearmiss_map_query(const struct NearmissSliceMap *map,
                                  const double (*min)[3],
                                  const double (*max)[3],
                                  struct NearmissOccupancy *out);

/*
 Returns a person: 0.4 by 0.4 wide, 1.6 high, climbs 0.35. Thread safety: any thread.
 */
struct NearmissAvatar nearmiss_avatar(void);

/*
 Puts an avatar's feet at a place where it can stand. `size` may be null. Thread safety: any thread;
 later, one call at a time.
 */
NearmissStatus nearmiss_walker_new(const struct NearmissSliceMap *map,
                                   const struct NearmissAvatar *size,
                                   const double (*start)[3],
                                   struct NearmissWalker **out);

/*
 Frees a walker; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `walker` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_walker_free(struct NearmissWalker *walker);

/*
 Takes one step towards a place, given as two horizontal coordinates, and slides along walls. The
 map is that of the walker. Thread safety: one call at a time for each walker.
 */
NearmissStatus nearmiss_walker_step(struct NearmissWalker *walker,
                                    const struct NearmissSliceMap *map,
                                    const double (*target)[2],
                                    struct NearmissStep *out);

/*
 Finds a short route that an avatar can walk, and writes its points, two horizontal coordinates
 each, to `out`, as many as its capacity holds, their whole number to `count`, and the length of the
 route to `length`, which is NaN if there is none. `size` may be null. Thread safety: any thread.

 # Safety
 `out` are `2 · capacity` places; other pointers are null or valid.
 */
NearmissStatus nearmiss_route(const struct NearmissSliceMap *map,
                              const struct NearmissAvatar *size,
                              const double (*from)[3],
                              const double (*to)[3],
                              double *out,
                              size_t capacity,
                              size_t *count,
                              double *length);

/*
 Makes an empty world. Thread safety: any thread.
 */
NearmissStatus nearmiss_world_new(struct NearmissWorld **out);

/*
 Frees a world; null is fine. Thread safety: no other call may use the handle at the same time or
 later.

 # Safety
 `world` is null or a handle that no other call uses.
 */
NearmissStatus nearmiss_world_free(struct NearmissWorld *world);

/*
 Adds a placed scan and writes its id to `out`. The world keeps the scan; its handle may be freed.
 Thread safety: no other call may use the world at the same time.
 */
NearmissStatus nearmiss_world_insert(struct NearmissWorld *world,
                                     const struct NearmissPlaced *scan,
                                     uint64_t *out);

/*
 Adds a mesh and writes its id to `out`. `pose` maps the frame of its vertices to the world; null leaves it
 where it is. The world keeps the mesh; its handle may be freed. Thread safety: no other call may use the
 world at the same time.
 */
NearmissStatus nearmiss_world_insert_mesh(struct NearmissWorld *world,
                                          const struct NearmissMesh *mesh,
                                          const struct NearmissPose *pose,
                                          uint64_t *out);

/*
 Adds a convex shape and writes its id to `out`. `pose` maps the frame in which the shape is given to the
 world; null leaves the shape where it is. The world copies the shape, and the points of a hull. Thread
 safety: no other call may use the world at the same time.

 # Safety
 The points of a hull are valid; other pointers are null or valid.
 */
NearmissStatus nearmiss_world_insert_shape(struct NearmissWorld *world,
                                           const struct NearmissShape *shape,
                                           const struct NearmissPose *pose,
                                           uint64_t *out);

/*
 Removes a body. Thread safety: no other call may use the world at the same time.
 */
NearmissStatus nearmiss_world_remove(struct NearmissWorld *world, uint64_t id);

/*
 Moves a body. Thread safety: no other call may use the world at the same time.
 */
NearmissStatus nearmiss_world_move(struct NearmissWorld *world,
                                   uint64_t id,
                                   const struct NearmissPose *pose);

/*
 Writes the pairs of bodies that may meet under `plan` to `out`, as many as its capacity holds, in
 ascending order, and their whole number to `count`. With `id_count` above 0, only pairs with one of
 the bodies `ids`, such as those that have moved; ids of no body are ignored. With an `id_count` of 0 all
 pairs, also if no body has moved. Thread safety: one call at a time for each scratch.

 # Safety
 `ids` are `id_count` numbers, `out` are `capacity` places; other pointers are null or valid.
 */
NearmissStatus nearmiss_world_near_pairs(const struct NearmissWorld *world,
                                         const struct NearmissPlan *plan,
                                         const uint64_t *ids,
                                         size_t id_count,
                                         struct NearmissScratch *scratch,
                                         struct NearmissBodyPair *out,
                                         size_t capacity,
                                         size_t *count);

/*
 Decides whether two bodies touch: two scans as `nearmiss_collide` does, a scan and a shape as
 `nearmiss_touch` does, a scan and a mesh as two scans, and other pairs exactly. A mesh is its triangles
 without an inside. `hint` counts for two scans only, and `limits` for pairs without a shape.

 Answers about two scans, or a scan and a mesh, have all fields; the source of a mesh is its triangle.
 Other answers have verdict, evidence, reason, witness, band and likelihood, and those about a scan and a
 shape the source of the scan. Their remaining numbers are missing, and their work is 0. Thread safety: one
 call at a time for each scratch and each hint.
 */
NearmissStatus nearmiss_world_collide(const struct NearmissWorld *world,
                                      const struct NearmissPlan *plan,
                                      struct NearmissBodyPair pair,
                                      const struct NearmissBudget *limits,
                                      struct NearmissHint *hint,
                                      struct NearmissScratch *scratch,
                                      struct NearmissAnswer *out);

/*
 Bounds the distance of two bodies: of two scans as `nearmiss_distance` does. It is unknown if a pose or a
 shape is out of range. `limits` may be null, and count for pairs without a shape. Thread safety: one call
 at a time for each scratch.
 */
NearmissStatus nearmiss_world_distance(const struct NearmissWorld *world,
                                       const struct NearmissPlan *plan,
                                       struct NearmissBodyPair pair,
                                       const struct NearmissBudget *limits,
                                       struct NearmissScratch *scratch,
                                       struct NearmissBodyDistance *out);

/*
 Bounds how far body b of a pair must be moved, in any direction, to be separate from body a. `solids` is
 a `NearmissSolids`, which counts for scans; shapes, and meshes where they are closed, are solid anyway.
 The margin of the plan counts for pairs with a scan. `limits` may be null. Takes as long as some hundred
 calls of `nearmiss_world_collide`. The first question about a mesh takes 20 ms more for 100,000 triangles.
 Thread safety: one call at a time for each scratch.
 */
NearmissStatus nearmiss_world_penetration(const struct NearmissWorld *world,
                                          const struct NearmissPlan *plan,
                                          struct NearmissBodyPair pair,
                                          int32_t solids,
                                          const struct NearmissBudget *limits,
                                          struct NearmissScratch *scratch,
                                          struct NearmissPenetration *out);

/*
 Finds the two bodies that are nearest to each other, of those whose bounding boxes come within `reach`,
 which may be infinite. `ignored` are pairs that do not count, such as neighbouring links of a robot. Pairs
 with a pose or a shape out of range are left out, as their distance is unknown.

 `lower` is at most `reach`, and a bound for all pairs that count. If nothing is found, both ids are
 `UINT64_MAX`, `upper` is infinite, and `lower` is `reach`, or 0 if a pair was left out. Thread safety: one
 call at a time for each scratch.

 # Safety
 `ignored` are `ignored_count` pairs; other pointers are null or valid.
 */
NearmissStatus nearmiss_world_nearest_pair(const struct NearmissWorld *world,
                                           const struct NearmissPlan *plan,
                                           double reach,
                                           const struct NearmissBodyPair *ignored,
                                           size_t ignored_count,
                                           struct NearmissScratch *scratch,
                                           struct NearmissBodyDistance *out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* NEARMISS_H */
