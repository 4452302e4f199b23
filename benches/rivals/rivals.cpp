// Times coal, FCL and OctoMap's trees on poses from a file, for `bench sweep --program` and `bench
// meshes --program`. Each pose is asked once by one engine in a pass of its own; the clock is read
// around the query alone.
//
// rivals OBJECT POSES [--distances]
//
// OBJECT has the lines `r RADIUS`, `v X Y Z` and, for a mesh, `f I J K` from 0. POSES has twelve
// numbers a line, the rows of rotation and translation of the second copy. The output has a line
// `engine NAME PREPARED_MS` for each engine, and then for each pose `HIT NANOSECONDS DISTANCE
// NANOSECONDS`; the last two are -1 without `--distances` and where the copies meet.

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <coal/BVH/BVH_model.h>
#include <coal/collision.h>
#include <coal/distance.h>
#include <coal/octree.h>
#include <fcl/fcl.h>

using Clock = std::chrono::steady_clock;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Object {
    double r = 0.0;
    std::vector<Vector3d> vertices;
    std::vector<std::array<std::size_t, 3>> triangles;
};

struct Pose {
    Matrix3d rotation;
    Vector3d translation;
};

static double since(Clock::time_point start) {
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

static Object readObject(const char *path) {
    Object object;
    std::ifstream file(path);
    std::string line, kind;
    while (std::getline(file, line)) {
        std::istringstream words(line);
        words >> kind;
        if (kind == "r") {
            words >> object.r;
        } else if (kind == "v") {
            Vector3d v;
            words >> v[0] >> v[1] >> v[2];
            object.vertices.push_back(v);
        } else if (kind == "f") {
            std::array<std::size_t, 3> f;
            words >> f[0] >> f[1] >> f[2];
            object.triangles.push_back(f);
        }
    }
    return object;
}

static std::vector<Pose> readPoses(const char *path) {
    std::vector<Pose> poses;
    std::ifstream file(path);
    double m[12];
    while (file >> m[0]) {
        for (int i = 1; i < 12; ++i) file >> m[i];
        Pose pose;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) pose.rotation(i, j) = m[4 * i + j];
            pose.translation[i] = m[4 * i + 3];
        }
        poses.push_back(pose);
    }
    return poses;
}

// `collide(pose)` and `distance(pose)` answer one pose.
template <class Collide, class Distance>
static void run(const char *name, double prepared, const std::vector<Pose> &poses, bool distances, Collide collide,
                Distance distance) {
    std::printf("engine %s %.3f\n", name, prepared / 1e6);
    for (std::size_t i = 0; i < std::min<std::size_t>(poses.size(), 100); ++i) (void)collide(poses[i]);
    std::vector<std::pair<bool, double>> replies;
    for (const Pose &pose : poses) {
        const auto start = Clock::now();
        const bool hit = collide(pose);
        replies.emplace_back(hit, since(start));
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
        double value = -1.0, time = -1.0;
        if (distances && !replies[i].first) {
            const auto start = Clock::now();
            value = distance(poses[i]);
            time = since(start);
        }
        std::printf("%d %.0f %.17g %.0f\n", replies[i].first ? 1 : 0, replies[i].second, value, time);
    }
}

static void runCoal(const Object &object, const std::vector<Pose> &poses, bool distances) {
    const auto start = Clock::now();
    auto model = std::make_shared<coal::BVHModel<coal::OBBRSS>>();
    model->beginModel();
    std::vector<coal::Vec3s> vertices(object.vertices.begin(), object.vertices.end());
    std::vector<coal::Triangle> triangles;
    for (const auto &f : object.triangles) triangles.emplace_back(f[0], f[1], f[2]);
    model->addSubModel(vertices, triangles);
    model->endModel();
    const double prepared = since(start);
    const coal::Transform3s identity;
    const coal::CollisionRequest request(coal::CollisionRequestFlag::NO_REQUEST, 1);  // a verdict alone
    const coal::DistanceRequest nearest;
    run("coal-OBBRSS", prepared, poses, distances,
        [&](const Pose &pose) {
            coal::CollisionResult result;
            return coal::collide(model.get(), identity, model.get(), coal::Transform3s(pose.rotation, pose.translation),
                                 request, result) > 0;
        },
        [&](const Pose &pose) {
            coal::DistanceResult result;
            return coal::distance(model.get(), identity, model.get(),
                                  coal::Transform3s(pose.rotation, pose.translation), nearest, result);
        });
}

static void runFcl(const Object &object, const std::vector<Pose> &poses, bool distances) {
    const auto start = Clock::now();
    auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
    std::vector<fcl::Triangle> triangles;
    for (const auto &f : object.triangles) triangles.emplace_back(f[0], f[1], f[2]);
    model->beginModel();
    model->addSubModel(object.vertices, triangles);
    model->endModel();
    const double prepared = since(start);
    const fcl::Transform3d identity = fcl::Transform3d::Identity();
    const auto placed = [](const Pose &pose) {
        fcl::Transform3d transform = fcl::Transform3d::Identity();
        transform.linear() = pose.rotation;
        transform.translation() = pose.translation;
        return transform;
    };
    run("FCL-OBBRSS", prepared, poses, distances,
        [&](const Pose &pose) {
            const fcl::CollisionRequestd request;
            fcl::CollisionResultd result;
            return fcl::collide(model.get(), identity, model.get(), placed(pose), request, result) > 0;
        },
        [&](const Pose &pose) {
            const fcl::DistanceRequestd request;
            fcl::DistanceResultd result;
            return fcl::distance(model.get(), identity, model.get(), placed(pose), request, result);
        });
}

// Voxels of one sampling radius about the vertices, as a user of OctoMap would hold a scan.
static void runOctrees(const Object &object, const std::vector<Pose> &poses) {
    const auto start = Clock::now();
    auto octomap = std::make_shared<octomap::OcTree>(object.r);
    for (const Vector3d &v : object.vertices) octomap->updateNode(v[0], v[1], v[2], true, true);
    octomap->updateInnerOccupancy();
    coal::OcTree tree(octomap);
    const double prepared = since(start);
    const coal::Transform3s identity;
    // With a request for contacts coal 3.0.3 reports a hit as soon as the boxes of the roots meet.
    const coal::CollisionRequest request(coal::CollisionRequestFlag::NO_REQUEST, 1);
    run("octrees-of-OctoMap-by-coal", prepared, poses, false,
        [&](const Pose &pose) {
            coal::CollisionResult result;
            return coal::collide(&tree, identity, &tree, coal::Transform3s(pose.rotation, pose.translation), request,
                                 result) > 0;
        },
        [](const Pose &) { return -1.0; });
}

int main(int argc, char **argv) {
    if (argc < 3) {
        std::cerr << "expected `rivals OBJECT POSES [--distances]`\n";
        return 2;
    }
    const Object object = readObject(argv[1]);
    const std::vector<Pose> poses = readPoses(argv[2]);
    const bool distances = argc > 3 && std::string(argv[3]) == "--distances";
    if (!object.triangles.empty()) {
        runCoal(object, poses, distances);
        runFcl(object, poses, distances);
    }
    runOctrees(object, poses);
    return 0;
}
