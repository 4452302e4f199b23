/* Prepares a scan, saves it, and asks where two copies touch: example SCAN */
#include <nearmiss.h>

#include <stdio.h>
#include <string.h>

#define TRY(call)                                                   \
    do {                                                            \
        if ((call) != NEARMISS_STATUS_OK) {                         \
            fprintf(stderr, "error: %s\n", nearmiss_last_error());  \
            return 1;                                               \
        }                                                           \
    } while (0)

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: example SCAN\n");
        return 2;
    }
    /* At start-up: the library must have the version of the header. */
    if (strcmp(nearmiss_version(), NEARMISS_VERSION) != 0) {
        fprintf(stderr, "error: expected nearmiss " NEARMISS_VERSION ", got %s\n", nearmiss_version());
        return 1;
    }
    /* Once: prepare the scan, save it, open it by mapping the file. */
    NearmissScan *prepared, *scan;
    NearmissScanAbout about;
    TRY(nearmiss_scan_read(argv[1], NULL, &prepared));
    TRY(nearmiss_scan_save(prepared, "example.nm"));
    TRY(nearmiss_scan_free(prepared));
    TRY(nearmiss_scan_open("example.nm", NEARMISS_CHECKS_STRUCTURE, &scan));
    TRY(nearmiss_scan_about(scan, &about));
    printf("%llu points, sampling radius %g\n", (unsigned long long)about.points, about.sampling_radius);

    /* Once for each sort of question, each thread, and each pair. */
    NearmissOptions options = nearmiss_options();
    options.margin = about.sampling_radius;
    NearmissPlan *plan;
    NearmissScratch *scratch;
    NearmissHint *hint;
    TRY(nearmiss_plan_new(&options, scan, scan, &plan));
    TRY(nearmiss_scratch_new(&scratch));
    TRY(nearmiss_hint_new(&hint));

    /* Each frame: a copy approaches along x. */
    double width = about.max[0] - about.min[0];
    NearmissPlaced still = {scan, nearmiss_pose_identity()}, moving = still;
    NearmissBudget budget = nearmiss_unlimited();
    budget.seconds = 500e-6;
    for (int frame = 0; frame < 60; frame++) {
        moving.pose.translation[0] = width * (1.2 - 0.02 * frame);
        NearmissManifoldPoint points[8];
        NearmissManifoldList list = {points, 8, 0};
        NearmissAnswer answer;
        TRY(nearmiss_manifold(plan, &still, &moving, &budget, hint, scratch, &list, &answer));
        if (answer.verdict == NEARMISS_VERDICT_TOUCHING) {
            printf("frame %d: touching, contact points: %zu\n", frame, list.count);
            for (size_t i = 0; i < list.count; i++) {
                const double *at = points[i].point;
                printf("  at (%.4f, %.4f, %.4f), gap %.4f\n", at[0], at[1], at[2], points[i].gap);
            }
            break;
        }
    }
    nearmiss_hint_free(hint);
    nearmiss_scratch_free(scratch);
    nearmiss_plan_free(plan);
    nearmiss_scan_free(scan);
    return 0;
}
