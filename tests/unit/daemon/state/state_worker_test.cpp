// SPDX-License-Identifier: Apache-2.0
// The thread that waits for the disk.
#include "daemon/state/state_file.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <cstddef>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::daemon {
namespace {

using Done = base::Result<void>;

TEST(StateWorker, DoesJobsInTheirOrderInAnotherThread) {
  std::vector<int> done;
  StateWorker worker;
  std::promise<void> gate;
  auto first = worker.run([&, opened = gate.get_future().share()] {
    opened.wait();
    done.push_back(1);
    return base::Result<std::thread::id>(std::this_thread::get_id());
  });
  auto second = worker.run([&] {
    done.push_back(2);
    return base::Result<std::size_t>(done.size());
  });
  EXPECT_EQ(second.wait_for(std::chrono::seconds(0)), std::future_status::timeout);  // behind the first
  gate.set_value();
  EXPECT_EQ(second.get().value(), 2U);
  EXPECT_NE(first.get().value(), std::this_thread::get_id());
  EXPECT_EQ(done, (std::vector<int>{1, 2}));
}

TEST(StateWorker, DoesWhatWaitsBeforeItEnds) {
  int done = 0;
  {
    StateWorker worker;
    for (int i = 0; i < 100; ++i)
      worker.run([&] {
        ++done;
        return Done();
      });
  }
  EXPECT_EQ(done, 100);
}

// If the end waited for the job it would never come: the job goes on only after it.
TEST(StateWorker, EndsThoughAJobDoesNotAndLeavesOutThoseBehindIt) {
  std::promise<void> gate;
  std::future<Done> blocked;
  std::future<Done> behind;
  {
    StateWorker worker(std::chrono::milliseconds(10));
    blocked = worker.run([opened = gate.get_future().share()] {
      opened.wait();
      return Done();
    });
    behind = worker.run([] { return Done(); });
  }
  EXPECT_THROW(behind.get(), std::future_error);
  gate.set_value();
  EXPECT_TRUE(blocked.get());
}

/// While it lives, the system provides no thread: no stack is that large.
class NoThreads {
 public:
  NoThreads() {
    ::pthread_getattr_default_np(&before_);
    pthread_attr_t huge = before_;
    ::pthread_attr_setstacksize(&huge, std::size_t{1} << 60);
    ::pthread_setattr_default_np(&huge);
  }
  ~NoThreads() { ::pthread_setattr_default_np(&before_); }

 private:
  pthread_attr_t before_;
};

// The thread that calls also answers clients and stops the box.
TEST(StateWorker, LeavesAJobUndoneForWhichThereIsNoThreadAndSaysSo) {
  StateWorker worker;
  bool done = false;
  const auto job = [&] {
    done = true;
    return Done();
  };
  {
    const NoThreads no_threads;
    const Done refused = worker.run(job).get();
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("thread state: cannot be started"), std::string::npos)
        << refused.error().text();
  }
  EXPECT_FALSE(done);
  EXPECT_TRUE(worker.run(job).get());
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace hapticd::daemon
