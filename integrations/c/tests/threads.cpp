// The header in C++17: owners of handles, and threads that share a scan and a plan.
#include "check.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

template <auto Free> struct Freed {
    template <typename T> void operator()(T *handle) const { Free(handle); }
};
using Scan = std::unique_ptr<NearmissScan, Freed<nearmiss_scan_free>>;
using Plan = std::unique_ptr<NearmissPlan, Freed<nearmiss_plan_free>>;
using Scratch = std::unique_ptr<NearmissScratch, Freed<nearmiss_scratch_free>>;

template <typename Owner, typename Make> Owner made(Make make) {
    typename Owner::pointer handle = nullptr;
    OK(make(&handle));
    return Owner(handle);
}

int main() {
    std::vector<double> points(3 * PLATE);
    fill_plate(points.data());
    auto scan = made<Scan>([&](auto out) { return nearmiss_scan_from_points(points.data(), PLATE, nullptr, out); });
    auto plan = made<Plan>([&](auto out) { return nearmiss_plan_new(nullptr, scan.get(), scan.get(), out); });

    std::vector<int> touching(4, 0);
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; k++) {
        threads.emplace_back([&, k] {
            auto scratch = made<Scratch>([](auto out) { return nearmiss_scratch_new(out); });
            NearmissPlaced a = {scan.get(), nearmiss_pose_identity()}, b = a;
            b.pose.rotation[0] = std::sin(0.75);
            b.pose.rotation[3] = std::cos(0.75);
            for (int i = 0; i < 500; i++) {
                b.pose.translation[2] = 1.0 - 0.002 * i;
                b.pose.translation[1] = 0.5;
                NearmissAnswer answer;
                OK(nearmiss_collide(plan.get(), &a, &b, nullptr, nullptr, scratch.get(), &answer));
                touching[k] += answer.verdict == NEARMISS_VERDICT_TOUCHING;
            }
            // Messages belong to their thread.
            CHECK(std::strlen(nearmiss_last_error()) == 0);
            CHECK(nearmiss_scan_about(nullptr, nullptr) == NEARMISS_STATUS_NULL);
        });
    }
    for (auto &thread : threads) {
        thread.join();
    }
    for (int count : touching) {
        CHECK(count == touching[0] && count > 0 && count < 500);
    }
    CHECK(std::strlen(nearmiss_last_error()) == 0);
    std::puts("threads: ok");
}
