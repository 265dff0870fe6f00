// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/child/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <thread>
#include <utility>

namespace hapticd::tools {
namespace {

std::vector<char*> pointersTo(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

std::vector<std::string> environmentWith(const std::vector<std::string>& added) {
  std::vector<std::string> all = added;  // first: of two with the same name the first is taken
  for (char** variable = environ; *variable != nullptr; ++variable) all.emplace_back(*variable);
  return all;
}

/// Data prepared for the child before it exists, because it borrows this process's memory.
struct Start {
  char** arguments;
  char** environment;
  int input;
  int output;
  int errors;
  pid_t parent;
};

/// Runs in the child before it becomes the program: system calls only. Returns errno.
int becomeProgram(const Start& start) {
  const bool good = ::setpgid(0, 0) == 0 && ::dup2(start.input, STDIN_FILENO) >= 0 &&
                    ::dup2(start.output, STDOUT_FILENO) >= 0 && ::dup2(start.errors, STDERR_FILENO) >= 0 &&
                    ::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0;
  if (!good || ::getppid() != start.parent) return good ? ESRCH : errno;
  ::execvpe(start.arguments[0], start.arguments, start.environment);
  return errno;
}

pid_t startProgram(const Start& start, int& error) {
  // The child runs in this process's memory until it is the program, and this thread waits meanwhile: the
  // error arrives without a pipe, and no page is copied.
  volatile int failure = 0;
  const pid_t child = ::vfork();
  if (child == 0) {
    failure = becomeProgram(start);
    ::_exit(127);
  }
  error = child < 0 ? errno : failure;
  if (child > 0 && failure != 0) ::waitpid(child, nullptr, 0);
  return error == 0 ? child : -1;
}

}  // namespace

std::string ChildEnding::text() const {
  return fmt::format("{} {}", exited ? "exit status" : "signal", code);
}

base::Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command,
                                               const Options& options, const std::string& remedy) {
  const std::vector<char*> arguments = pointersTo(command);
  const std::vector<std::string> variables = environmentWith(options.environment);
  const std::vector<char*> environment = pointersTo(variables);
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const Start start{const_cast<char**>(arguments.data()),
                    const_cast<char**>(environment.data()),
                    nowhere,
                    options.output >= 0 ? options.output : nowhere,
                    options.errors >= 0 ? options.errors : STDERR_FILENO,
                    ::getpid()};
  int error = 0;
  const pid_t child = startProgram(start, error);
  ::close(nowhere);
  if (child > 0) return ChildProcess(child);
  return std::unexpected(
      base::Error{command.front(), fmt::format("cannot be started: {}", std::strerror(error)), remedy});
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), ending_(other.ending_) {}

ChildProcess::~ChildProcess() {
  if (pid_ <= 0) return;
  ::kill(-pid_, SIGKILL);  // all of the group, what the program started included
  if (!ending_) ::waitpid(pid_, nullptr, 0);
}

void ChildProcess::signal(int number) const {
  if (!ending_) ::kill(pid_, number);
}

std::optional<ChildEnding> ChildProcess::ending() {
  int status = 0;
  if (ending_ || ::waitpid(pid_, &status, WNOHANG) != pid_) return ending_;
  ending_ = WIFEXITED(status) ? ChildEnding{true, WEXITSTATUS(status)} : ChildEnding{false, WTERMSIG(status)};
  return ending_;
}

std::optional<ChildEnding> ChildProcess::waitFor(std::chrono::milliseconds limit) {
  constexpr std::chrono::milliseconds kBetween{10};
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!ending() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(kBetween);
  return ending();
}

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
  interrupted = false;
  for (const int signal : {SIGINT, SIGTERM}) handle(signal, [](int) { interrupted = true; });
}

Interrupt::~Interrupt() {
  for (const int signal : {SIGINT, SIGTERM}) handle(signal, SIG_DFL);
}

bool Interrupt::requested() const noexcept {
  return interrupted;
}

}  // namespace hapticd::tools
