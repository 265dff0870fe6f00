// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include "rt/base/pose.h"
#include "rt/base/realtime_thread.h"
#include "rt/base/rigid_pose.h"

namespace hapticd::rt {
namespace {

double lengthOf(const Quaternion& q) {
  return std::sqrt(dot(q, q));
}

TEST(ShortestRotation, TurnsAnyDirectionIntoAnyOther) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> number;
  const auto direction = [&] { return Vec3{number(random), number(random), number(random)}; };
  for (int i = 0; i < 300; ++i) {
    const Vec3 from = direction();
    Vec3 to = direction();
    if (i % 3 == 1) to = -2 * from;
    if (i % 3 == 2) to = -1 * from + 1e-9 * to;
    const Quaternion q = shortestRotation(from, to);
    const Vec3 difference = rotated(q, (1 / norm(from)) * from) - (1 / norm(to)) * to;
    EXPECT_LT(norm(difference), 1e-8) << i;
    EXPECT_NEAR(lengthOf(q), 1, 1e-12);
    EXPECT_LE(norm(rotationVectorOf(q)), M_PI + 1e-12);
  }
  for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const Quaternion none = shortestRotation(axis, 3 * axis);
    EXPECT_LT(norm(rotationVectorOf(none)), 1e-12);
    EXPECT_LT(norm(rotated(shortestRotation(axis, -1 * axis), axis) + axis), 1e-12);
  }
}

TEST(QuaternionOf, TurnsAsItsMatrix) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  for (int i = 0; i < 200; ++i) {
    const std::array<double, 9> r = rotationOf({{}, angle(random), angle(random), angle(random)});
    const Quaternion q = quaternionOf(r);
    EXPECT_NEAR(lengthOf(q), 1, 1e-12);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vec3 unit{axis == 0 ? 1.0 : 0, axis == 1 ? 1.0 : 0, axis == 2 ? 1.0 : 0};
      const Vec3 column{r[axis], r[3 + axis], r[6 + axis]};
      EXPECT_LT(norm(rotated(q, unit) - column), 1e-12) << i;
    }
  }
}

// The stack of the force thread, whatever the size of this kernel's pages.

/// How many of the pages of 112 KiB below `top` are not in memory.
std::size_t absentPagesBelow(std::uintptr_t top) {
  constexpr std::size_t kBytes = 112 * 1024;
  const auto page_size = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t begin = (top - kBytes) / page_size * page_size;
  const std::size_t pages = (top - begin) / page_size;
  std::vector<unsigned char> resident(pages + 1);
  if (::mincore(reinterpret_cast<void*>(begin), pages * page_size, resident.data()) != 0) return pages;
  std::size_t absent = 0;
  for (std::size_t page = 0; page < pages; ++page) absent += (resident[page] & 1U) == 0 ? 1U : 0U;
  return absent;
}

TEST(PrefaultStack, BringsEveryPageOfTheStackIntoMemory) {
  std::size_t absent_before = 0, absent_after = 0;
  std::thread([&] {
    const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
    absent_before = absentPagesBelow(here);
    prefaultStack();
    absent_after = absentPagesBelow(here);
  }).join();
  EXPECT_GT(absent_before, 0U) << "the stack of a new thread: without absent pages this test says nothing";
  EXPECT_EQ(absent_after, 0U);
}

}  // namespace
}  // namespace hapticd::rt
