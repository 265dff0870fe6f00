// SPDX-License-Identifier: Apache-2.0
#include "daemon/box_warnings.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>

namespace hapticd::daemon {
namespace {

TEST(ThreadFaults, CountThePagesThatTheThreadTouchesForTheFirstTime) {
  constexpr std::size_t kPages = 200;
  const auto page_size = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  auto* const pages = static_cast<volatile char*>(
      ::mmap(nullptr, kPages * page_size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  ASSERT_NE(pages, MAP_FAILED);
  ::madvise(const_cast<char*>(pages), kPages * page_size, MADV_NOHUGEPAGE);
  const auto before = pageFaultsOf(::gettid());
  for (std::size_t page = 0; page < kPages; ++page) pages[page * page_size] = 1;
  const auto after = pageFaultsOf(::gettid());
  ::munmap(const_cast<char*>(pages), kPages * page_size);
  ASSERT_TRUE(before && after);
  EXPECT_GE(*after - *before, kPages);
}

TEST(ThreadFaults, AreUnknownOfAThreadThatIsNotThere) {
  EXPECT_FALSE(pageFaultsOf(0));
}

}  // namespace
}  // namespace hapticd::daemon
