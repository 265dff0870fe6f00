// SPDX-License-Identifier: Apache-2.0
#include "tests/support/program.h"

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string_view>

extern char** environ;

namespace hapticd::test {
namespace {

constexpr int kCouldNotStart = 127;

std::vector<std::string> environmentOf(const ProgramOptions& options) {
  std::vector<std::string> all = options.environment;
  // of two equal names the C library takes the first one and bash the last one
  const auto isPath = [](const std::string& variable) { return variable.starts_with("PATH="); };
  if (std::ranges::none_of(all, isPath)) all.emplace_back("PATH=/usr/bin:/bin");
  for (char** variable = environ; *variable != nullptr; ++variable) {
    for (const std::string_view kept :
         {"ASAN_OPTIONS=", "LSAN_OPTIONS=", "UBSAN_OPTIONS=", "TSAN_OPTIONS=", "HAPTICD_TEST_PATIENCE_S="}) {
      if (std::string_view(*variable).starts_with(kept)) all.emplace_back(*variable);
    }
  }
  return all;
}

/// Returns a file without a name, which accepts any output and never blocks the writer.
int nameless() {
  const int file = ::memfd_create("printed", MFD_CLOEXEC);
  if (file < 0) throw std::runtime_error("no memory file");
  return file;
}

/// Returns a pipe without a reader.
int brokenPipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  ::close(ends[0]);
  return ends[1];
}

std::string contentOf(int file) {
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) return {};
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  const ssize_t count = ::pread(file, text.data(), text.size(), 0);
  text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return text;
}

bool becomeUser(uid_t user) {
  return ::setgroups(0, nullptr) == 0 && ::setgid(user) == 0 && ::setuid(user) == 0;
}

bool limitFiles(std::size_t bytes) {
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{bytes, bytes};
  return ::setrlimit(RLIMIT_FSIZE, &limit) == 0;
}

bool limitMemory(std::size_t bytes) {
  const rlimit limit{bytes, bytes};
  return ::setrlimit(RLIMIT_AS, &limit) == 0;
}

/// Runs in the child between fork and exec: system calls only.
bool prepare(const ProgramOptions& options, int input, int output, int errors, pid_t parent) {
  bool good = ::setpgid(0, 0) == 0;
  good = good && ::dup2(input, STDIN_FILENO) >= 0 && ::dup2(output, STDOUT_FILENO) >= 0 &&
         ::dup2(errors, STDERR_FILENO) >= 0;
  if (options.largest_file_bytes) good = good && limitFiles(*options.largest_file_bytes);
  if (options.largest_memory_bytes) good = good && limitMemory(*options.largest_memory_bytes);
  if (options.user) good = good && becomeUser(*options.user);
  if (options.disk != nullptr) options.disk->install();  // what failed shows in the parent
  // after changing the user, which resets it
  return good && ::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && ::getppid() == parent;
}

}  // namespace

std::chrono::seconds maxPatience() {
  const char* const text = std::getenv("HAPTICD_TEST_PATIENCE_S");
  const int seconds = text != nullptr ? std::atoi(text) : 60;
  if (seconds < 1 || seconds > 1000) throw std::runtime_error("HAPTICD_TEST_PATIENCE_S is not 1 to 1000");
  return std::chrono::seconds(seconds);
}

std::ostream& operator<<(std::ostream& stream, const Ending& ending) {
  return stream << (ending.exited ? "exit status " : "signal ") << ending.code;
}

Program::Program(const std::vector<std::string>& command, const ProgramOptions& options)
    : output_(nameless()), errors_(options.stderr_broken ? brokenPipe() : nameless()) {
  const std::vector<std::string> environment = environmentOf(options);
  const std::vector<char*> arguments = execVector(command);
  const std::vector<char*> variables = execVector(environment);
  const int program = ::open(command.front().c_str(), O_RDONLY | O_CLOEXEC);
  const int input = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    if (prepare(options, input, output_, options.stderr_to >= 0 ? options.stderr_to : errors_, parent)) {
      // By descriptor only where it must be, because another user may not have access to the path: where the
      // kernel starts programs in an emulator, one that was started by descriptor cannot find itself.
      options.user ? ::fexecve(program, arguments.data(), variables.data())
                   : ::execve(arguments[0], arguments.data(), variables.data());
    }
    ::_exit(kCouldNotStart);
  }
  ::close(program);
  ::close(input);
  if (pid_ < 0) throw std::runtime_error("cannot fork");
  if (options.disk != nullptr) stallable_ = options.disk->supervise();
}

Program::~Program() {
  if (running()) {
    ::kill(pid_, SIGKILL);
    reap(0);
  }
  ::kill(-pid_, SIGKILL);
  ::close(output_);
  ::close(errors_);
}

void Program::reap(int options) {
  int status = 0;
  rusage usage{};
  if (ending_ || ::wait4(pid_, &status, options, &usage) != pid_) return;
  constexpr std::size_t kUnitBytes = 1024;
  peak_memory_bytes_ = static_cast<std::size_t>(usage.ru_maxrss) * kUnitBytes;
  ending_ = WIFEXITED(status) ? Ending{true, WEXITSTATUS(status)} : Ending{false, WTERMSIG(status)};
}

bool Program::running() {
  reap(WNOHANG);
  return !ending_;
}

void Program::signal(int number) const {
  if (!ending_) ::kill(pid_, number);
}

Ending Program::wait() {
  if (!becomesTrue([this] { return !running(); }, std::chrono::milliseconds(2))) {
    ADD_FAILURE() << "the program does not end; its errors: " << errors();
    ::kill(pid_, SIGKILL);
    reap(0);
  }
  return *ending_;
}

bool Program::leftProcesses() const {
  return ::kill(-pid_, 0) == 0;
}

std::string Program::output() const {
  return contentOf(output_);
}

std::string Program::errors() const {
  return contentOf(errors_);
}

std::string unpackedProgram(const std::string& name) {
  for (const char* folder : {HAPTICD_UNPACKED_PROGRAMS, "/usr/bin", "/usr/sbin"}) {
    const std::filesystem::path program = std::filesystem::path(folder) / name;
    if (std::filesystem::exists(program)) return program.string();
  }
  return {};
}

Finished runToEnd(const std::vector<std::string>& command, const ProgramOptions& options) {
  Program program(command, options);
  const Ending ending = program.wait();
  return {ending, program.output(), program.errors()};
}

}  // namespace hapticd::test
