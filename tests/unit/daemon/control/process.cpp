// SPDX-License-Identifier: Apache-2.0
#include "process.h"

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "config/descriptor.h"
#include "tests/support/exec_vector.h"

namespace hapticd::daemon::test {
namespace {

struct Stream {
  config::Descriptor ours;
  config::Descriptor its;
};

Stream pipeStream() {
  int ends[2] = {-1, -1};
  EXPECT_EQ(0, ::pipe2(ends, O_CLOEXEC));
  return {config::Descriptor(ends[0]), config::Descriptor(ends[1])};
}

Stream terminalStream() {
  int ours = -1;
  int its = -1;
  EXPECT_EQ(0, ::openpty(&ours, &its, nullptr, nullptr, nullptr));
  ::fcntl(ours, F_SETFD, FD_CLOEXEC);
  ::fcntl(its, F_SETFD, FD_CLOEXEC);
  return {config::Descriptor(ours), config::Descriptor(its)};
}

/// Appends the available output to `text`; returns false at the end of the stream.
bool readInto(const config::Descriptor& from, std::string& text) {
  std::array<char, 65536> chunk;
  const ssize_t count = ::read(from.get(), chunk.data(), chunk.size());
  if (count <= 0) return false;  // a terminal ends with EIO
  text.append(chunk.data(), static_cast<std::size_t>(count));
  return true;
}

void collect(pid_t process, Stream& output, Stream& errors, std::string interrupt_after,
             ProcessResult& result) {
  std::array<pollfd, 2> descriptors{{{output.ours.get(), POLLIN, 0}, {errors.ours.get(), POLLIN, 0}}};
  while (descriptors[0].fd >= 0 || descriptors[1].fd >= 0) {
    if (::poll(descriptors.data(), descriptors.size(), 60'000) <= 0) {  // so long that only a hang reaches it
      ADD_FAILURE() << "the program hangs";
      ::kill(process, SIGKILL);
      return;
    }
    if (descriptors[0].revents != 0 && !readInto(output.ours, result.output)) descriptors[0].fd = -1;
    if (descriptors[1].revents != 0 && !readInto(errors.ours, result.errors)) descriptors[1].fd = -1;
    if (!interrupt_after.empty() && result.output.find(interrupt_after) != std::string::npos) {
      ::kill(process, SIGINT);
      interrupt_after.clear();
    }
  }
}

}  // namespace

ProcessResult runProcess(const std::vector<std::string>& command, const ProcessOptions& options) {
  Stream output = options.terminal ? terminalStream() : pipeStream();
  Stream errors = pipeStream();
  std::vector<std::string> environment = options.environment;
  environment.push_back("PATH=/usr/bin:/bin");
  const std::vector<char*> arguments = hapticd::test::execVector(command);
  const std::vector<char*> variables = hapticd::test::execVector(environment);
  // By descriptor, because another user may not be allowed to walk to the program.
  const config::Descriptor program(::open(command.front().c_str(), O_RDONLY | O_CLOEXEC));

  const pid_t process = ::fork();
  if (process == 0) {
    ::dup2(output.its.get(), STDOUT_FILENO);
    ::dup2(errors.its.get(), STDERR_FILENO);
    const bool changed = options.uid == 0 || (::setgroups(0, nullptr) == 0 && ::setgid(options.uid) == 0 &&
                                              ::setuid(options.uid) == 0);
    if (changed) ::fexecve(program.get(), arguments.data(), variables.data());
    ::_exit(127);
  }
  output.its.close();
  errors.its.close();
  ProcessResult result;
  collect(process, output, errors, options.interrupt_after, result);
  int status = 0;
  EXPECT_EQ(process, ::waitpid(process, &status, 0));
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

}  // namespace hapticd::daemon::test
