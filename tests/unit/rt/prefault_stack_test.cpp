// SPDX-License-Identifier: Apache-2.0
// The stack of the force thread, whatever the size of this kernel's pages.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "rt/base/realtime_thread.h"

namespace hapticd::rt {
namespace {

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
