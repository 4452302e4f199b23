/* Every question has the answer that is known for a plate. C11. */
#include "check.h"

#include <math.h>

static NearmissScan *plate;
static NearmissPlan *plan;
static NearmissScratch *scratch;

static NearmissPlaced at(double x, double y, double z) {
    NearmissPlaced placed = {plate, nearmiss_pose_identity()};
    placed.pose.translation[0] = x;
    placed.pose.translation[1] = y;
    placed.pose.translation[2] = z;
    return placed;
}

/* The plate turned upright about x, at this place. */
static NearmissPlaced upright(double x, double y, double z) {
    NearmissPlaced placed = at(x, y, z);
    placed.pose.rotation[0] = placed.pose.rotation[3] = 1.0;
    return placed;
}

static void pairs(void) {
    NearmissPlaced low = at(0, 0, 0), high = at(0, 0, 0.3), cross = upright(0.1, 0.51, -0.4);
    NearmissAnswer answer;
    OK(nearmiss_collide(plan, &low, &high, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED && answer.evidence == NEARMISS_EVIDENCE_CERTIFIED);
    CHECK(answer.gap > 0.0 && answer.gap <= 0.3 && isnan(answer.witness[0]) && answer.source_a == UINT32_MAX);
    OK(nearmiss_collide(plan, &low, &cross, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && fabs(answer.witness[2]) < 1e-6);
    CHECK(fabs(answer.witness[1] - 0.51) < 1e-6 && answer.source_a < PLATE && answer.reason == NEARMISS_REASON_NONE);

    NearmissHint *hint;
    OK(nearmiss_hint_new(&hint));
    for (int step = 0; step < 40; step++) {
        NearmissPlaced lowered = at(0, 0, 0.4 - 0.005 * step);
        OK(nearmiss_collide(plan, &low, &lowered, NULL, hint, scratch, &answer));
        CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED);
    }
    NearmissManifoldPoint points[8];
    NearmissManifoldList manifold = {points, 8, 0};
    OK(nearmiss_manifold(plan, &low, &cross, NULL, hint, scratch, &manifold, &answer));
    CHECK(manifold.count >= 2 && manifold.count <= 8 && fabs(points[0].point[1] - 0.51) < 0.03);
    manifold.capacity = 0;
    manifold.points = NULL;
    OK(nearmiss_manifold(plan, &low, &cross, NULL, NULL, scratch, &manifold, &answer));
    CHECK(manifold.count >= 2);
    OK(nearmiss_hint_free(hint));

    NearmissContact some[2];
    NearmissContactList contacts;
    contacts.contacts = some, contacts.capacity = 2;
    OK(nearmiss_contacts(plan, &low, &cross, NULL, scratch, &contacts, &answer));
    CHECK(contacts.complete && contacts.count > 2 && fabs(some[1].point[2]) < 0.02);

    NearmissDistance distance;
    OK(nearmiss_distance(plan, &low, &high, NULL, scratch, &distance));
    CHECK(distance.lower <= 0.3 && fabs(distance.upper - 0.3) < 1e-6 && distance.complete);
    NearmissPlaced beyond = low;
    beyond.pose.scale = 1e-40;
    OK(nearmiss_distance(plan, &low, &beyond, NULL, scratch, &distance));
    CHECK(distance.lower == 0.0 && isinf(distance.upper) && isnan(distance.point_a[0]));
    CHECK(distance.source_b == UINT32_MAX && distance.evidence == NEARMISS_EVIDENCE_NONE && !distance.complete);

    NearmissPenetration out;
    OK(nearmiss_penetration(plan, &low, &high, NEARMISS_SOLIDS_NONE, NULL, scratch, &out));
    CHECK(out.lower == 0.0 && out.upper == 0.0 && out.complete);
    OK(nearmiss_penetration(plan, &low, &cross, NEARMISS_SOLIDS_NONE, NULL, scratch, &out));
    CHECK(out.lower >= 0.0 && out.lower <= out.upper && out.upper > 0.0 && isfinite(out.upper));
    NearmissPlaced moved = cross;
    for (int k = 0; k < 3; k++) {
        moved.pose.translation[k] += 1.001 * out.upper * out.direction[k];
    }
    OK(nearmiss_collide(plan, &low, &moved, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED);
    CHECK(nearmiss_penetration(plan, &low, &high, 4, NULL, scratch, &out) == NEARMISS_STATUS_ARGUMENT);

    NearmissBudget budget = nearmiss_unlimited();
    budget.work = 1;
    OK(nearmiss_penetration(plan, &low, &cross, NEARMISS_SOLIDS_NONE, &budget, scratch, &out));
    CHECK(!out.complete && isfinite(out.upper));
    OK(nearmiss_collide(plan, &low, &cross, &budget, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_UNDECIDED && answer.reason == NEARMISS_REASON_BUDGET);
    CHECK(answer.likelihood >= 0.0 && answer.likelihood <= 1.0);
    budget.work = UINT64_MAX;
    budget.seconds = 10.0;
    OK(nearmiss_collide(plan, &low, &cross, &budget, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING);
}

static void shapes(void) {
    NearmissPlaced floor = at(0, 0, 0);
    NearmissPose above = at(0.5, 0.5, 0.2).pose, turned = upright(0.5, 0.5, 0.2).pose;
    const double centre[3] = {0.5, 0.5, 0.2}, end[3] = {0.6, 0.5, 0.2};
    const double a[3] = {0.5, 0.5, 0.1}, b[3] = {0.6, 0.5, 0.3}, c[3] = {0.5, 0.6, 0.3};
    const double hull[12] = {0.5, 0.5, 0.1, 0.6, 0.5, 0.3, 0.5, 0.6, 0.3, 0.5, 0.5, 0.3};
    NearmissShape all[7] = {
        nearmiss_sphere(&centre, 0.1),      nearmiss_capsule(&centre, &end, 0.1),
        nearmiss_box(above, 0.1, 0.1, 0.1), nearmiss_cylinder(turned, 0.1, 0.05),
        nearmiss_cone(turned, 0.1, 0.05),   nearmiss_triangle(&a, &b, &c, 0.0),
        nearmiss_hull(hull, 4, 0.0),
    };
    NearmissShapeAnswer answers[7];
    NearmissShapeDistance distances[7];
    OK(nearmiss_touch(plan, &floor, all, 7, scratch, answers));
    OK(nearmiss_shape_distance(plan, &floor, all, 7, INFINITY, scratch, distances));
    for (int i = 0; i < 7; i++) {
        CHECK(answers[i].verdict == NEARMISS_VERDICT_SEPARATED);
        CHECK(distances[i].lower <= 0.1 && fabs(distances[i].upper - 0.1) < 1e-6);
    }
    OK(nearmiss_shape_distance(plan, &floor, all, 1, 0.01, scratch, distances));
    CHECK(isinf(distances[0].upper) && distances[0].source == UINT32_MAX && distances[0].lower == 0.01);
    /* Lower bounds hold where no disc is near enough, too. Discs may be nearer than they prove. */
    OK(nearmiss_shape_distance(plan, &floor, all, 7, 0.0999, scratch, distances));
    for (int i = 0; i < 7; i++) {
        CHECK(isinf(distances[i].upper) && distances[i].lower > 0.05 && distances[i].lower <= 0.0999);
        CHECK(distances[i].evidence == NEARMISS_EVIDENCE_NONE && isnan(distances[i].point[0]));
    }
    NearmissPenetration pressed;
    NearmissPose magnified = above;
    magnified.scale = 1e20;
    NearmissShape beyond = nearmiss_box(magnified, 1e300, 1e300, 1e300);
    const double limits[2] = {0.5, INFINITY};
    for (int i = 0; i < 2; i++) {
        OK(nearmiss_shape_distance(plan, &floor, &beyond, 1, limits[i], scratch, distances));
        CHECK(distances[0].lower == 0.0 && isinf(distances[0].upper));
    }
    OK(nearmiss_touch(plan, &floor, &beyond, 1, scratch, answers));
    CHECK(answers[0].verdict == NEARMISS_VERDICT_UNDECIDED && answers[0].reason == NEARMISS_REASON_SHAPE);
    OK(nearmiss_shape_penetration(plan, &floor, &beyond, NEARMISS_SOLIDS_NONE, NULL, scratch, &pressed));
    CHECK(pressed.lower == 0.0 && isinf(pressed.upper) && pressed.evidence == NEARMISS_EVIDENCE_NONE);

    const double sunk[3] = {0.5, 0.5, 0.05};
    NearmissShape ball = nearmiss_sphere(&sunk, 0.1);
    NearmissPenetration out;
    OK(nearmiss_shape_penetration(plan, &floor, &ball, NEARMISS_SOLIDS_NONE, NULL, scratch, &out));
    CHECK(out.lower <= 0.05 + 1e-9 && out.lower > 0.04 && fabs(out.upper - 0.05) < 2e-3 && out.direction[2] > 0.99);
    CHECK(nearmiss_shape_penetration(plan, &floor, &ball, 2, NULL, scratch, &out) == NEARMISS_STATUS_ARGUMENT);

    NearmissShapeHint *hint;
    OK(nearmiss_shape_hint_new(&hint));
    uint64_t id = 0;
    double height = 0.12;
    for (int frame = 0; frame < 100; frame++) {
        height -= 0.002;
        const double place[3] = {0.5, 0.5, height};
        NearmissShape ball = nearmiss_sphere(&place, 0.1);
        NearmissShapeContact contacts[8];
        size_t count;
        OK(nearmiss_shape_contacts(plan, &floor, &ball, hint, scratch, contacts, 8, &count));
        if (count > 0) {
            CHECK(id == 0 || id == contacts[0].id);
            id = contacts[0].id;
            height += fmax(contacts[0].depth, 0.0) * contacts[0].normal[2];
        }
    }
    CHECK(fabs(height - 0.1) < 1e-3);
    OK(nearmiss_shape_hint_clear(hint));
    OK(nearmiss_shape_hint_free(hint));
}

static void rays(void) {
    NearmissPlaced floor = at(0, 0, 0);
    NearmissRay down[3] = {
        {{0.3, 0.3, 2.0}, {0, 0, -5}, INFINITY, 0},
        {{0.3, 0.3, 2.0}, {0, 0, -1}, 1.0, 0},
        {{0.3, 0.3, 2.0}, {0, 0, -1}, INFINITY, 0.1},
    };
    NearmissRayHit hits[3];
    OK(nearmiss_cast(plan, &floor, down, 3, scratch, hits));
    CHECK(hits[0].hit && fabs(hits[0].t - 2.0) < 1e-6 && fabs(hits[0].normal[2]) > 0.99);
    CHECK(!hits[1].hit && isnan(hits[1].t));
    CHECK(hits[2].hit && fabs(hits[2].t - 1.9) < 1e-6);
    size_t count;
    OK(nearmiss_cast_all(plan, &floor, &down[0], scratch, hits, 3, &count));
    CHECK(count == 1);
}

static void motions(void) {
    NearmissPose down[2] = {at(0, 0, 1).pose, upright(0.1, 0.5, -0.5).pose};
    NearmissMotion *still, *moving;
    NearmissPose origin = nearmiss_pose_identity();
    OK(nearmiss_motion_new(&origin, 1, &still));
    OK(nearmiss_motion_new(down, 2, &moving));
    NearmissSweepAnswer answer;
    OK(nearmiss_sweep(plan, plate, still, plate, moving, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.t_free > 0 && answer.t_free <= answer.t_hit);
    CHECK(answer.t_hit < 1);
    OK(nearmiss_motion_free(moving));
    down[1] = at(0, 0, 0.5).pose;
    OK(nearmiss_motion_new(down, 2, &moving));
    OK(nearmiss_sweep(plan, plate, still, plate, moving, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED && answer.t_free == 1.0 && answer.clearance > 0.3);

    NearmissPlaced floor = at(0, 0, 0);
    const double place[3] = {0.5, 0.5, 0};
    NearmissShape ball = nearmiss_sphere(&place, 0.1);
    OK(nearmiss_shape_sweep(plan, &floor, &ball, moving, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED && answer.t_free == 1.0);
    CHECK(answer.clearance > 0.35 && answer.clearance <= 0.4 && answer.upper <= 0.4 + 1e-9);
    OK(nearmiss_motion_free(moving));
    down[1] = at(0, 0, -1).pose;
    OK(nearmiss_motion_new(down, 2, &moving));
    OK(nearmiss_shape_sweep(plan, &floor, &ball, moving, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.t_free <= answer.t_hit);
    CHECK(fabs(answer.t_hit - 0.45) < 0.01 && answer.t_hit - answer.t_free < 0.02);
    CHECK(fabs(answer.witness[2]) < 1e-3 && answer.evidence == NEARMISS_EVIDENCE_NONE);
    NearmissPose magnified = origin;
    magnified.scale = 1e20;
    NearmissShape beyond = nearmiss_box(magnified, 1e300, 1e300, 1e300);
    OK(nearmiss_shape_sweep(plan, &floor, &beyond, moving, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_UNDECIDED && answer.reason == NEARMISS_REASON_SHAPE);
    ball.rounding = -1;
    CHECK(nearmiss_shape_sweep(plan, &floor, &ball, moving, scratch, &answer) == NEARMISS_STATUS_ARGUMENT);
    CHECK(nearmiss_shape_sweep(plan, &floor, NULL, moving, scratch, &answer) == NEARMISS_STATUS_NULL);
    OK(nearmiss_motion_free(moving));
    OK(nearmiss_motion_free(still));
}

static void worlds(void) {
    NearmissWorld *world;
    uint64_t ids[3];
    NearmissPlaced low = at(0, 0, 0), cross = upright(0.1, 0.5, -0.4), far = at(9, 9, 9);
    OK(nearmiss_world_new(&world));
    OK(nearmiss_world_insert(world, &low, &ids[0]));
    OK(nearmiss_world_insert(world, &cross, &ids[1]));
    OK(nearmiss_world_insert(world, &far, &ids[2]));
    NearmissBodyPair near[3];
    size_t count;
    OK(nearmiss_world_near_pairs(world, plan, NULL, 0, scratch, near, 3, &count));
    CHECK(count == 1 && near[0].a == ids[0] && near[0].b == ids[1]);
    NearmissAnswer answer;
    OK(nearmiss_world_collide(world, plan, near[0], NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING);
    OK(nearmiss_world_move(world, ids[1], &far.pose));
    OK(nearmiss_world_near_pairs(world, plan, &ids[0], 1, scratch, near, 3, &count));
    CHECK(count == 0);
    OK(nearmiss_world_remove(world, ids[2]));
    FAILS(nearmiss_world_remove(world, ids[2]), NEARMISS_STATUS_ARGUMENT, "id of a body");
    FAILS(nearmiss_world_collide(world, plan, (NearmissBodyPair){0, 77}, NULL, NULL, scratch, &answer),
          NEARMISS_STATUS_ARGUMENT, "got 77");
    OK(nearmiss_world_free(world));
}

/* A robot of two links above a floor: its nearest pair, and which of its bodies touch. */
static void worlds_of_shapes(void) {
    NearmissWorld *world;
    uint64_t floor, arm, hand, wedge;
    NearmissPlaced low = at(0, 0, 0);
    const double start[3] = {0, 0, 0}, end[3] = {0.2, 0, 0}, centre[3] = {0, 0, 0};
    double corners[12] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
    NearmissShape rod = nearmiss_capsule(&start, &end, 0.02), ball = nearmiss_sphere(&centre, 0.05);
    NearmissShape hull = nearmiss_hull(corners, 4, 0.0);
    OK(nearmiss_world_new(&world));
    OK(nearmiss_world_insert(world, &low, &floor));
    NearmissPose pose = at(0.3, 0.5, 0.4).pose;
    OK(nearmiss_world_insert_shape(world, &rod, &pose, &arm));
    pose = at(0.5, 0.5, 0.4).pose;
    OK(nearmiss_world_insert_shape(world, &ball, &pose, &hand));
    OK(nearmiss_world_insert_shape(world, &hull, NULL, &wedge));
    corners[0] = corners[1] = corners[2] = NAN; /* The world has a copy. */
    pose = at(0.3, 0.3, 3.0).pose;
    OK(nearmiss_world_move(world, wedge, &pose));

    NearmissBodyPair joint = {hand, arm};
    NearmissBodyDistance found;
    OK(nearmiss_world_nearest_pair(world, plan, INFINITY, &joint, 1, scratch, &found));
    CHECK(found.pair.a == floor && found.pair.b == hand && found.lower > 0.34 && fabs(found.upper - 0.35) < 1e-6);
    CHECK(fabs(found.point_a[2]) < 1e-6 && fabs(found.point_b[2] - 0.35) < 1e-6);
    OK(nearmiss_world_nearest_pair(world, plan, INFINITY, NULL, 0, scratch, &found));
    CHECK(found.upper == 0.0);
    OK(nearmiss_world_nearest_pair(world, plan, 0.01, &joint, 1, scratch, &found));
    CHECK(found.pair.a == UINT64_MAX && isinf(found.upper) && found.lower == 0.01 && found.complete);
    OK(nearmiss_world_distance(world, plan, (NearmissBodyPair){floor, wedge}, NULL, scratch, &found));
    CHECK(found.lower > 2.95 && fabs(found.upper - 3.0) < 1e-6 && found.complete);
    /* Nothing is known about a body whose scale is out of range. */
    NearmissWorld *odd;
    uint64_t tiny, thing;
    NearmissPlaced shrunk = low;
    shrunk.pose.scale = 1e-40;
    OK(nearmiss_world_new(&odd));
    OK(nearmiss_world_insert(odd, &low, &thing));
    OK(nearmiss_world_insert(odd, &shrunk, &tiny));
    OK(nearmiss_world_distance(odd, plan, (NearmissBodyPair){thing, tiny}, NULL, scratch, &found));
    CHECK(found.lower == 0.0 && isinf(found.upper) && isnan(found.point_b[0]) && !found.complete);
    CHECK(found.pair.a == thing && found.evidence == NEARMISS_EVIDENCE_NONE);
    OK(nearmiss_world_nearest_pair(odd, plan, 0.5, NULL, 0, scratch, &found));
    CHECK(found.pair.a == UINT64_MAX && found.lower == 0.0 && isinf(found.upper) && !found.complete);
    NearmissBodyPair both = {thing, tiny};
    OK(nearmiss_world_nearest_pair(odd, plan, 0.5, &both, 1, scratch, &found));
    CHECK(found.pair.a == UINT64_MAX && found.lower == 0.5);
    OK(nearmiss_world_free(odd));

    NearmissAnswer answer;
    OK(nearmiss_world_collide(world, plan, joint, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.evidence == NEARMISS_EVIDENCE_CERTIFIED);
    CHECK(answer.source_a == UINT32_MAX && answer.band == 0.0);
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){floor, hand}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED);
    pose = at(0.5, 0.5, 0.03).pose;
    OK(nearmiss_world_move(world, hand, &pose));
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){floor, hand}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.source_a != UINT32_MAX);
    CHECK(answer.source_b == UINT32_MAX && fabs(answer.witness[2]) < 1e-6);
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){hand, floor}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.source_b != UINT32_MAX);

    NearmissBodyPair near[6];
    size_t count;
    OK(nearmiss_world_near_pairs(world, plan, &hand, 1, scratch, near, 6, &count));
    CHECK(count == 1 && near[0].a == floor && near[0].b == hand);
    OK(nearmiss_world_remove(world, hand));
    FAILS(nearmiss_world_remove(world, hand), NEARMISS_STATUS_ARGUMENT, "id of a body");
    rod.radius = -1.0;
    FAILS(nearmiss_world_insert_shape(world, &rod, NULL, &arm), NEARMISS_STATUS_ARGUMENT, "at least 0, got -1");
    FAILS(nearmiss_world_nearest_pair(world, plan, -1.0, NULL, 0, scratch, &found), NEARMISS_STATUS_ARGUMENT,
          "reach of at least 0");
    OK(nearmiss_world_free(world));
}

/* A box of triangles beside a scan, a ball and another box. */
static void worlds_of_meshes(void) {
    double corners[24];
    uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                          2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (int i = 0; i < 8; i++) {
        corners[3 * i] = 0.1 * (i & 1), corners[3 * i + 1] = 0.1 * (i >> 1 & 1), corners[3 * i + 2] = 0.1 * (i >> 2);
    }
    NearmissMesh *cube, *again;
    NearmissMeshAbout about;
    OK(nearmiss_mesh_from_triangles(corners, 8, faces, 12, 0.0, &cube));
    OK(nearmiss_mesh_about(cube, &about));
    CHECK(about.triangles == 12 && about.vertices == 8 && about.welded == 0 && about.is_closed);
    CHECK(fabs(about.max[2] - 0.1) < 1e-9 && about.min[0] == 0.0);
    size_t length;
    OK(nearmiss_mesh_to_bytes(cube, NULL, 0, &length));
    uint8_t *bytes = malloc(length);
    OK(nearmiss_mesh_to_bytes(cube, bytes, length, &length));
    OK(nearmiss_mesh_from_bytes(bytes, length, NEARMISS_CHECKS_FULL, &again));
    free(bytes);

    NearmissWorld *world;
    NearmissPlan *any;
    uint64_t floor, first, second, ball;
    NearmissPlaced low = at(0, 0, 0);
    const double centre[3] = {0, 0, 0};
    NearmissShape sphere = nearmiss_sphere(&centre, 0.05);
    OK(nearmiss_world_new(&world));
    OK(nearmiss_plan_new(NULL, NULL, NULL, &any));
    NearmissPose pose = at(0.3, 0.3, 0.2).pose;
    OK(nearmiss_world_insert_mesh(world, cube, &pose, &first));
    pose = at(0.35, 0.3, 0.25).pose;
    OK(nearmiss_world_insert_mesh(world, again, &pose, &second));
    OK(nearmiss_world_insert_shape(world, &sphere, NULL, &ball));
    OK(nearmiss_mesh_free(cube));
    OK(nearmiss_mesh_free(again));
    pose = at(0.35, 0.35, 0.5).pose;
    OK(nearmiss_world_move(world, ball, &pose));
    NearmissAnswer answer;
    NearmissBodyDistance found;
    OK(nearmiss_world_collide(world, any, (NearmissBodyPair){first, second}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && answer.evidence == NEARMISS_EVIDENCE_CERTIFIED);
    CHECK(answer.witness[2] > 0.25 - 1e-6 && answer.witness[2] < 0.3 + 1e-6);
    pose = at(0.3, 0.3, 0.6).pose;
    OK(nearmiss_world_move(world, second, &pose));
    OK(nearmiss_world_collide(world, any, (NearmissBodyPair){first, second}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED);
    OK(nearmiss_world_distance(world, any, (NearmissBodyPair){first, ball}, NULL, scratch, &found));
    CHECK(found.lower > 0.149 && fabs(found.upper - 0.15) < 1e-6);
    OK(nearmiss_world_nearest_pair(world, any, INFINITY, NULL, 0, scratch, &found));
    CHECK(found.pair.a == second && found.pair.b == ball && fabs(found.upper - 0.05) < 1e-6);

    OK(nearmiss_world_insert(world, &low, &floor));
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){floor, first}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_SEPARATED && answer.evidence == NEARMISS_EVIDENCE_CERTIFIED);
    CHECK(answer.gap > 0.0 && answer.gap <= 0.2 && isnan(answer.likelihood));
    OK(nearmiss_world_distance(world, plan, (NearmissBodyPair){floor, first}, NULL, scratch, &found));
    CHECK(found.lower <= 0.2 && found.lower > 0.17 && fabs(found.upper - 0.2) < 1e-6 && found.complete);
    CHECK(fabs(found.point_a[2]) < 1e-6 && fabs(found.point_b[2] - 0.2) < 1e-6);
    pose = at(0.3, 0.3, -0.05).pose;
    OK(nearmiss_world_move(world, first, &pose));
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){first, floor}, NULL, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_TOUCHING && fabs(answer.witness[2]) < 0.02);
    CHECK(answer.source_a < 12 && answer.source_b < PLATE && answer.node_pairs + answer.leaf_pairs > 0);
    CHECK(fabs(answer.normal_a[2]) < 1e-6 && fabs(answer.normal_b[2]) > 0.99);
    NearmissBudget budget = nearmiss_unlimited();
    budget.work = 1;
    OK(nearmiss_world_collide(world, plan, (NearmissBodyPair){floor, first}, &budget, NULL, scratch, &answer));
    CHECK(answer.verdict == NEARMISS_VERDICT_UNDECIDED && answer.reason == NEARMISS_REASON_BUDGET);
    CHECK(answer.likelihood >= 0.0 && answer.likelihood <= 1.0 && answer.source_a == UINT32_MAX);
    OK(nearmiss_world_distance(world, plan, (NearmissBodyPair){floor, first}, &budget, scratch, &found));
    CHECK(!found.complete && found.lower >= 0.0 && found.lower <= found.upper);

    NearmissPenetration out;
    NearmissBodyPair pressed = {floor, first};
    OK(nearmiss_world_penetration(world, plan, pressed, NEARMISS_SOLIDS_NONE, NULL, scratch, &out));
    CHECK(fabs(out.upper - 0.05) < 2e-3 && out.direction[2] > 0.99 && out.lower > 0.02 && out.lower <= 0.05);
    pressed = (NearmissBodyPair){first, floor};
    OK(nearmiss_world_penetration(world, plan, pressed, NEARMISS_SOLIDS_NONE, NULL, scratch, &out));
    CHECK(fabs(out.upper - 0.05) < 2e-3 && out.direction[2] < -0.99);
    pose = at(0.3, 0.3, 0.52).pose;
    OK(nearmiss_world_move(world, second, &pose));
    OK(nearmiss_world_penetration(world, any, (NearmissBodyPair){second, ball}, 0, NULL, scratch, &out));
    CHECK(out.lower > 0.029 && fabs(out.upper - 0.03) < 1e-5 && out.direction[2] < -0.99 && out.band == 0.0);
    OK(nearmiss_world_penetration(world, any, (NearmissBodyPair){second, first}, 0, NULL, scratch, &out));
    CHECK(out.upper == 0.0);
    /* A ball inside a scanned ball touches nothing, unless that is solid. */
    static double shell[3 * 3000];
    for (int i = 0; i < 3000; i++) {
        const double z = 1.0 - (2 * i + 1) / 3000.0, across = sqrt(1.0 - z * z), turn = 2.399963 * i;
        shell[3 * i] = across * cos(turn), shell[3 * i + 1] = across * sin(turn), shell[3 * i + 2] = z;
    }
    NearmissPlaced around = at(0.35, 0.35, 5.0);
    NearmissScan *scanned;
    uint64_t hollow;
    OK(nearmiss_scan_from_points(shell, 3000, NULL, &scanned));
    around.scan = scanned;
    OK(nearmiss_world_insert(world, &around, &hollow));
    OK(nearmiss_scan_free(scanned));
    OK(nearmiss_world_move(world, ball, &around.pose));
    const int32_t bits[3] = {NEARMISS_SOLIDS_NONE, NEARMISS_SOLIDS_A, NEARMISS_SOLIDS_B};
    for (int i = 0; i < 6; i++) {
        const NearmissBodyPair nested = i < 3 ? (NearmissBodyPair){hollow, ball} : (NearmissBodyPair){ball, hollow};
        OK(nearmiss_world_penetration(world, any, nested, bits[i % 3], NULL, scratch, &out));
        CHECK(i == 1 || i == 5 ? out.upper > 1.0 && out.upper < 1.1 : out.upper == 0.0);
    }
    FAILS(nearmiss_world_penetration(world, any, (NearmissBodyPair){second, 99}, 0, NULL, scratch, &out),
          NEARMISS_STATUS_ARGUMENT, "got 99");
    FAILS(nearmiss_world_penetration(world, any, pressed, 4, NULL, scratch, &out), NEARMISS_STATUS_ARGUMENT, "got 4");

    NearmissMesh *refused;
    faces[4] = 8;
    FAILS(nearmiss_mesh_from_triangles(corners, 8, faces, 12, 0.0, &refused), NEARMISS_STATUS_ARGUMENT, "vertex");
    CHECK(refused == NULL);
    faces[4] = 2, corners[5] = NAN;
    FAILS(nearmiss_mesh_from_triangles(corners, 8, faces, 12, 0.0, &refused), NEARMISS_STATUS_ARGUMENT, "finite");
    FAILS(nearmiss_mesh_from_triangles(corners, 8, NULL, 12, 0.0, &refused), NEARMISS_STATUS_NULL, "triangles");
    FAILS(nearmiss_mesh_read("missing.obj", 0.0, &refused), NEARMISS_STATUS_IO, "missing.obj");
    FAILS(nearmiss_mesh_open("missing.nm", 0, &refused), NEARMISS_STATUS_IO, "missing.nm");
    FAILS(nearmiss_mesh_free((NearmissMesh *)plate), NEARMISS_STATUS_HANDLE, "NearmissMesh");
    FAILS(nearmiss_world_insert_mesh(world, NULL, NULL, &first), NEARMISS_STATUS_NULL, "mesh");
    OK(nearmiss_plan_free(any));
    OK(nearmiss_world_free(world));
}

static void maps(void) {
    enum { SIDE = 60, COUNT = SIDE * SIDE + 4 * SIDE * 40 };
    double *points = malloc(3 * COUNT * sizeof *points), *p = points;
    for (int i = 0; i < SIDE * SIDE; i++) {
        *p++ = 0.1 * (i % SIDE), *p++ = 0.1 * (i / SIDE), *p++ = 0.0;
    }
    for (int i = 0; i < SIDE * 40; i++) {
        const double along = 0.1 * (i % SIDE), h = 0.05 * (i / SIDE), last = 0.1 * (SIDE - 1);
        const double walls[12] = {along, 0, h, along, last, h, 0, along, h, last, along, h};
        memcpy(p, walls, sizeof walls);
        p += 12;
    }
    NearmissMapOptions options = nearmiss_map_options();
    options.pixel = 0.1;
    options.up = "z";
    NearmissSliceMap *map;
    OK(nearmiss_map_from_points(points, COUNT, &options, &map));
    const double min[3] = {1, 1, 0.5}, max[3] = {3, 3, 1.5}, wall[3] = {-0.1, 1, 0.5};
    NearmissOccupancy found;
    OK(nearmiss_map_query(map, &min, &max, &found));
    CHECK(!found.collides && fabs(found.floor) < 0.05);
    OK(nearmiss_map_query(map, &wall, &max, &found));
    CHECK(found.collides);
    FAILS(nearmiss_map_query(map, &max, &min, &found), NEARMISS_STATUS_ARGUMENT, "min ≤ max");

    const double start[3] = {1, 1, 0}, goal[3] = {4, 4, 0}, outside[3] = {50, 1, 0}, ahead[2] = {3, 1};
    double route[20], length;
    size_t count;
    OK(nearmiss_route(map, NULL, &start, &goal, route, 10, &count, &length));
    CHECK(count >= 1 && length > 4.2 && length < 4.6);
    FAILS(nearmiss_route(map, NULL, &start, &outside, route, 10, &count, &length), NEARMISS_STATUS_ARGUMENT, "goal");
    NearmissWalker *walker;
    NearmissStep step = {{0, 0, 0}, false, false};
    OK(nearmiss_walker_new(map, NULL, &start, &walker));
    for (int i = 0; i < 60; i++) {
        OK(nearmiss_walker_step(walker, map, &ahead, &step));
    }
    CHECK(fabs(step.position[0] - 3) < 1e-9 && !step.blocked && !step.falling);
    OK(nearmiss_walker_free(walker));
    FAILS(nearmiss_walker_new(map, NULL, &outside, &walker), NEARMISS_STATUS_ARGUMENT, "nearest place to stand");
    CHECK(walker == NULL);
    OK(nearmiss_map_free(map));
    options.up = "w";
    FAILS(nearmiss_map_from_points(points, COUNT, &options, &map), NEARMISS_STATUS_ARGUMENT, "got `w`");
    free(points);
}

static void messages(void) {
    float data[4 * 12];
    for (int i = 0; i < 12; i++) {
        data[4 * i] = (float)(i % 4), data[4 * i + 1] = (float)(i / 4), data[4 * i + 2] = i == 5 ? NAN : 0.0f;
        data[4 * i + 3] = 0;
    }
    NearmissMessageField fields[3] = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}};
    NearmissMessage message = {3, 4, fields, 3, 0, 16, 64, (const uint8_t *)data, sizeof data};
    NearmissScan *scan;
    NearmissScanAbout about;
    OK(nearmiss_scan_from_point_cloud2(&message, NULL, &scan));
    OK(nearmiss_scan_about(scan, &about));
    CHECK(about.points == 11 && about.not_finite == 1 && about.max[0] == 3.0);
    OK(nearmiss_scan_free(scan));
    message.data_length--;
    FAILS(nearmiss_scan_from_point_cloud2(&message, NULL, &scan), NEARMISS_STATUS_ARGUMENT, "192 bytes");
}

int main(void) {
    static double points[3 * PLATE];
    fill_plate(points);
    OK(nearmiss_scan_from_points(points, PLATE, NULL, &plate));
    OK(nearmiss_plan_new(NULL, plate, plate, &plan));
    OK(nearmiss_scratch_new(&scratch));
    pairs();
    shapes();
    rays();
    motions();
    worlds();
    worlds_of_shapes();
    worlds_of_meshes();
    maps();
    messages();
    OK(nearmiss_scratch_free(scratch));
    OK(nearmiss_plan_free(plan));
    OK(nearmiss_scan_free(plate));
    puts("questions: ok");
    return 0;
}
