// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/terminal_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <utility>

#include "tests/support/program.h"

namespace hapticd::test {
namespace {

winsize sizeOf(int rows, int columns) {
  return {static_cast<unsigned short>(rows), static_cast<unsigned short>(columns), 0, 0};
}

}  // namespace

TerminalProgram::TerminalProgram(const std::vector<std::string>& command,
                                 const std::vector<std::string>& environment, int rows, int columns) {
  const std::vector<char*> arguments = execVector(command);
  const std::vector<char*> variables = execVector(environment);
  const winsize size = sizeOf(rows, columns);
  pid_ = ::forkpty(&terminal_, nullptr, nullptr, &size);
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::execve(arguments.front(), arguments.data(), variables.data());
    ::_exit(127);
  }
  if (pid_ < 0) throw std::runtime_error("cannot make a terminal");
  ::fcntl(terminal_, F_SETFL, O_NONBLOCK);
}

TerminalProgram::~TerminalProgram() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  hangUp();
}

bool TerminalProgram::prints(const std::string& text) {
  return becomesTrue([&] { return output().find(text) != std::string::npos; });
}

void TerminalProgram::resize(int rows, int columns) {
  const winsize size = sizeOf(rows, columns);
  ::ioctl(terminal_, TIOCSWINSZ, &size);
}

void TerminalProgram::press(char key) {
  if (::write(terminal_, &key, 1) != 1) ADD_FAILURE() << "the terminal takes no keys";
}

void TerminalProgram::signal(int number) {
  ::kill(pid_, number);
}

void TerminalProgram::hangUp() {
  if (terminal_ >= 0) ::close(std::exchange(terminal_, -1));
}

Ending TerminalProgram::wait() {
  int status = 0;
  const bool ended = becomesTrue([&] {
    readAll();  // a full terminal would keep it from ending
    return ::waitpid(pid_, &status, WNOHANG) == pid_;
  });
  if (!ended) {
    ADD_FAILURE() << "the program does not end; it printed: " << output_;
    return {};
  }
  pid_ = -1;
  readAll();
  return WIFEXITED(status) ? Ending{true, WEXITSTATUS(status)} : Ending{false, WTERMSIG(status)};
}

const std::string& TerminalProgram::output() {
  readAll();
  return output_;
}

void TerminalProgram::readAll() {
  std::array<char, 4096> bytes;
  for (;;) {
    const ssize_t count = terminal_ < 0 ? -1 : ::read(terminal_, bytes.data(), bytes.size());
    if (count <= 0) return;
    output_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace hapticd::test
