// SPDX-License-Identifier: Apache-2.0
// The thread that waits for the disk.
#include "daemon/state/state_worker.h"

#include <gtest/gtest.h>

#include <vector>

namespace hapticd::daemon {
namespace {

TEST(StateWorker, DoesJobsInTheirOrderInAnotherThread) {
  std::vector<int> done;
  StateWorker worker;
  std::promise<void> gate;
  auto first = worker.run([&, opened = gate.get_future().share()] {
    opened.wait();
    done.push_back(1);
    return std::this_thread::get_id();
  });
  auto second = worker.run([&] {
    done.push_back(2);
    return static_cast<int>(done.size());
  });
  EXPECT_EQ(second.wait_for(std::chrono::seconds(0)), std::future_status::timeout);  // behind the first
  gate.set_value();
  EXPECT_EQ(second.get(), 2);
  EXPECT_NE(first.get(), std::this_thread::get_id());
  EXPECT_EQ(done, (std::vector<int>{1, 2}));
}

TEST(StateWorker, DoesWhatWaitsBeforeItEnds) {
  int done = 0;
  {
    StateWorker worker;
    for (int i = 0; i < 100; ++i) worker.run([&] { ++done; });
  }
  EXPECT_EQ(done, 100);
}

// If the end waited for the job it would never come: the job goes on only after it.
TEST(StateWorker, EndsThoughAJobDoesNotAndLeavesOutThoseBehindIt) {
  std::promise<void> gate;
  std::future<void> blocked;
  std::future<void> behind;
  {
    StateWorker worker(std::chrono::milliseconds(10));
    blocked = worker.run([opened = gate.get_future().share()] { opened.wait(); });
    behind = worker.run([] {});
  }
  EXPECT_THROW(behind.get(), std::future_error);
  gate.set_value();
  blocked.get();
}

}  // namespace
}  // namespace hapticd::daemon
