/* Null, wrong and freed handles, NaN, wrong sizes and damaged bytes give a status, never a crash. C11. */
#include "check.h"

#include <math.h>

static void files(NearmissScan *scan) {
    NearmissScan *again;
    size_t length;
    OK(nearmiss_scan_to_bytes(scan, NULL, 0, &length));
    uint8_t *bytes = malloc(length);
    OK(nearmiss_scan_to_bytes(scan, bytes, length, &length));
    OK(nearmiss_scan_from_bytes(bytes, length, NEARMISS_CHECKS_FULL, &again));
    OK(nearmiss_scan_free(again));
    FAILS(nearmiss_scan_from_bytes(bytes, length / 2, NEARMISS_CHECKS_STRUCTURE, &again), NEARMISS_STATUS_DATA, "");
    CHECK(again == NULL);
    for (size_t at = 0; at < length; at += length / 97 + 1) {
        bytes[at] ^= 0x40;
        NearmissStatus status = nearmiss_scan_from_bytes(bytes, length, NEARMISS_CHECKS_FULL, &again);
        CHECK(status == NEARMISS_STATUS_OK || status == NEARMISS_STATUS_DATA);
        nearmiss_scan_free(again);
        bytes[at] ^= 0x40;
    }
    FAILS(nearmiss_scan_from_bytes(bytes, length, 7, &again), NEARMISS_STATUS_ARGUMENT, "got 7");
    FAILS(nearmiss_scan_from_bytes(NULL, 9, 0, &again), NEARMISS_STATUS_NULL, "bytes");
    FAILS(nearmiss_scan_open("missing.nm", 0, &again), NEARMISS_STATUS_IO, "missing.nm");
    FAILS(nearmiss_scan_read("missing.ply", NULL, &again), NEARMISS_STATUS_IO, "missing.ply");
    FAILS(nearmiss_scan_open(NULL, 0, &again), NEARMISS_STATUS_NULL, "file");
    FAILS(nearmiss_scan_open("\xff\xfe", 0, &again), NEARMISS_STATUS_ARGUMENT, "UTF-8");
    FAILS(nearmiss_scan_save(scan, "/nonexistent/folder/a.nm"), NEARMISS_STATUS_IO, "folder");
    free(bytes);
}

static void points_and_options(NearmissScan *scan) {
    double points[3 * PLATE];
    fill_plate(points);
    NearmissScan *made;
    NearmissPrepareOptions prepare = nearmiss_prepare_options();
    points[10] = NAN;
    FAILS(nearmiss_scan_from_points(points, PLATE, &prepare, &made), NEARMISS_STATUS_ARGUMENT, "point 3");
    prepare.drop_invalid = 1;
    OK(nearmiss_scan_from_points(points, PLATE, &prepare, &made));
    OK(nearmiss_scan_free(made));
    prepare.radius_neighbours = 99;
    FAILS(nearmiss_scan_from_points(points, PLATE, &prepare, &made), NEARMISS_STATUS_ARGUMENT, "got 99");
    FAILS(nearmiss_scan_from_points(points, 3, NULL, &made), NEARMISS_STATUS_ARGUMENT, "at least 8");
    FAILS(nearmiss_scan_from_points(NULL, 9, NULL, &made), NEARMISS_STATUS_NULL, "points");
    FAILS(nearmiss_scan_from_points(points, SIZE_MAX / 8, NULL, &made), NEARMISS_STATUS_ARGUMENT, "points");
    FAILS(nearmiss_scan_from_points(points, PLATE, NULL, NULL), NEARMISS_STATUS_NULL, "out");
    FAILS(nearmiss_scan_from_floats(NULL, 9, NULL, &made), NEARMISS_STATUS_NULL, "points");

    NearmissPlan *plan;
    NearmissOptions options = nearmiss_options();
    options.margin = NAN;
    FAILS(nearmiss_plan_new(&options, scan, scan, &plan), NEARMISS_STATUS_ARGUMENT, "margin");
    CHECK(plan == NULL);
    options = nearmiss_options();
    options.semantics = 9;
    FAILS(nearmiss_plan_new(&options, scan, scan, &plan), NEARMISS_STATUS_ARGUMENT, "semantics of 0 to 2");
    options = nearmiss_options();
    options.relative = 2;
    FAILS(nearmiss_plan_new(&options, scan, scan, &plan), NEARMISS_STATUS_ARGUMENT, "relative");
    FAILS(nearmiss_plan_new(NULL, NULL, scan, &plan), NEARMISS_STATUS_NULL, "`a`");

    NearmissPose pose;
    double matrix[16] = {0, -2, 0, 5, 2, 0, 0, 6, 0, 0, 2, 7, 0, 0, 0, 1};
    OK(nearmiss_pose_from_matrix((const double(*)[16])matrix, &pose));
    CHECK(pose.scale == 2 && pose.translation[2] == 7 && fabs(pose.rotation[2] - pose.rotation[3]) < 1e-12);
    matrix[1] = 2;
    FAILS(nearmiss_pose_from_matrix((const double(*)[16])matrix, &pose), NEARMISS_STATUS_ARGUMENT, "determinant");
    matrix[0] = NAN;
    FAILS(nearmiss_pose_from_matrix((const double(*)[16])matrix, &pose), NEARMISS_STATUS_ARGUMENT, "finite");
    FAILS(nearmiss_pose_from_matrix(NULL, &pose), NEARMISS_STATUS_NULL, "matrix");
}

static void handles(NearmissScan *scan) {
    NearmissPlan *plan;
    NearmissScratch *scratch, *freed;
    NearmissAnswer answer;
    OK(nearmiss_plan_new(NULL, scan, scan, &plan));
    OK(nearmiss_scratch_new(&scratch));
    NearmissPlaced a = {scan, nearmiss_pose_identity()}, b = a;

    FAILS(nearmiss_collide(NULL, &a, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_NULL, "plan");
    FAILS(nearmiss_collide(plan, NULL, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_NULL, "`a`");
    FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, NULL, &answer), NEARMISS_STATUS_NULL, "scratch");
    FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, scratch, NULL), NEARMISS_STATUS_NULL, "out");
    FAILS(nearmiss_collide((NearmissPlan *)scratch, &a, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_HANDLE,
          "handle of NearmissPlan, got another kind");
    FAILS(nearmiss_scan_free((NearmissScan *)plan), NEARMISS_STATUS_HANDLE, "NearmissScan");
    b.scan = NULL;
    FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_NULL, "scan");
    b = a;
    double *numbers[3] = {&b.pose.translation[1], &b.pose.rotation[2], &b.pose.scale};
    const double bad[4] = {NAN, INFINITY, -INFINITY, 1e300};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < (k == 0 ? 3 : 4); i++) {
            const double kept = *numbers[k];
            *numbers[k] = bad[i];
            FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_ARGUMENT, "quaternion");
            *numbers[k] = kept;
        }
    }
    b.pose.scale = 0;
    FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, scratch, &answer), NEARMISS_STATUS_ARGUMENT, "scale above 0");
    b = a;
    NearmissBudget budget = {UINT64_MAX, NAN};
    FAILS(nearmiss_collide(plan, &a, &b, &budget, NULL, scratch, &answer), NEARMISS_STATUS_ARGUMENT, "seconds");
    NearmissContactList list = {NULL, 4, 0, false};
    FAILS(nearmiss_contacts(plan, &a, &b, NULL, scratch, &list, &answer), NEARMISS_STATUS_NULL, "places");

    const double nan[3] = {NAN, 0, 0}, origin[3] = {0, 0, 0};
    NearmissShape shapes[5] = {
        nearmiss_sphere(&nan, 1), nearmiss_sphere(&origin, -1), nearmiss_sphere(NULL, 1),
        nearmiss_hull(NULL, 3, 0), nearmiss_hull(origin, 0, 0),
    };
    NearmissShapeAnswer touched;
    for (int i = 0; i < 5; i++) {
        CHECK(nearmiss_touch(plan, &a, &shapes[i], 1, scratch, &touched) != NEARMISS_STATUS_OK);
    }
    shapes[0].kind = 99;
    shapes[0].corners[0][0] = 0;
    FAILS(nearmiss_touch(plan, &a, shapes, 1, scratch, &touched), NEARMISS_STATUS_ARGUMENT, "got 99");
    FAILS(nearmiss_touch(plan, &a, NULL, 1, scratch, &touched), NEARMISS_STATUS_NULL, "shapes");
    OK(nearmiss_touch(plan, &a, NULL, 0, scratch, NULL));
    FAILS(nearmiss_touch(plan, &a, shapes, 1, scratch, NULL), NEARMISS_STATUS_NULL, "out");
    NearmissShapeAnswer *odd = (NearmissShapeAnswer *)((char *)&touched + 1);
    FAILS(nearmiss_touch(plan, &a, shapes, 1, scratch, odd), NEARMISS_STATUS_ARGUMENT, "aligned to 8 bytes for out");
    NearmissShapeDistance apart;
    FAILS(nearmiss_shape_distance(plan, &a, shapes, 1, NAN, scratch, &apart), NEARMISS_STATUS_ARGUMENT, "`within`");
    NearmissRay ray = {{0, 0, 1}, {0, 0, 0}, INFINITY, 0};
    NearmissRayHit hit;
    FAILS(nearmiss_cast(plan, &a, &ray, 1, scratch, &hit), NEARMISS_STATUS_ARGUMENT, "direction other than 0");
    NearmissMotion *motion;
    FAILS(nearmiss_motion_new(NULL, 0, &motion), NEARMISS_STATUS_ARGUMENT, "at least one pose");
    CHECK(motion == NULL);
    FAILS(nearmiss_motion_free((NearmissMotion *)scan), NEARMISS_STATUS_HANDLE, "NearmissMotion");

    /* The last handles that were freed are recognised. */
    OK(nearmiss_scratch_new(&freed));
    OK(nearmiss_scratch_free(freed));
    FAILS(nearmiss_scratch_free(freed), NEARMISS_STATUS_HANDLE, "freed");
    FAILS(nearmiss_collide(plan, &a, &b, NULL, NULL, freed, &answer), NEARMISS_STATUS_HANDLE, "freed");
    for (int i = 0; i < 1000; i++) {
        OK(nearmiss_scratch_new(&freed));
        OK(nearmiss_scratch_free(freed));
    }
    OK(nearmiss_plan_free(NULL));
    OK(nearmiss_scan_free(NULL));
    OK(nearmiss_plan_free(plan));
    OK(nearmiss_scratch_free(scratch));
}

/* The library has the version of the header, and its numbers are those of the text. */
static void version(void) {
    char text[32];
    snprintf(text, sizeof text, "%d.%d.%d", NEARMISS_VERSION_MAJOR, NEARMISS_VERSION_MINOR, NEARMISS_VERSION_PATCH);
    CHECK(strcmp(nearmiss_version(), NEARMISS_VERSION) == 0);
    CHECK(strncmp(NEARMISS_VERSION, text, strlen(text)) == 0);
}

int main(void) {
    static double points[3 * PLATE];
    fill_plate(points);
    NearmissScan *scan;
    CHECK(strlen(nearmiss_last_error()) == 0);
    version();
    OK(nearmiss_scan_from_points(points, PLATE, NULL, &scan));
    files(scan);
    points_and_options(scan);
    handles(scan);
    OK(nearmiss_scan_free(scan));
    puts("faults: ok");
    return 0;
}
