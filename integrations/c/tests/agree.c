/* Answers poses as the command line does: agree SCAN < POSES. A pose is `x y z qx qy qz qw` of the
   second scan; a line of output is verdict, evidence, gap, witness, and both bounds of the distance. */
#include "check.h"

int main(int argc, char **argv) {
    NearmissScan *scan;
    NearmissPlan *plan;
    NearmissScratch *scratch;
    CHECK(argc == 2);
    OK(nearmiss_scan_open(argv[1], NEARMISS_CHECKS_FULL, &scan));
    OK(nearmiss_plan_new(NULL, scan, scan, &plan));
    OK(nearmiss_scratch_new(&scratch));
    NearmissPlaced a = {scan, nearmiss_pose_identity()}, b = a;
    double *t = b.pose.translation, *q = b.pose.rotation;
    while (scanf("%lf %lf %lf %lf %lf %lf %lf", &t[0], &t[1], &t[2], &q[0], &q[1], &q[2], &q[3]) == 7) {
        NearmissAnswer answer;
        NearmissDistance distance;
        OK(nearmiss_collide(plan, &a, &b, NULL, NULL, scratch, &answer));
        OK(nearmiss_distance(plan, &a, &b, NULL, scratch, &distance));
        const double *w = answer.witness;
        printf("%d %d %.17g %.17g %.17g %.17g %.17g %.17g\n", (int)answer.verdict, (int)answer.evidence, answer.gap,
               w[0], w[1], w[2], distance.lower, distance.upper);
    }
    nearmiss_scratch_free(scratch);
    nearmiss_plan_free(plan);
    nearmiss_scan_free(scan);
    return 0;
}
