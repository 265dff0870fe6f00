// SPDX-License-Identifier: Apache-2.0
#include "config/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>

namespace hapticd::config {
namespace {

/// errno of the first write to standard output that failed; 0: none failed.
int output_error = 0;

void noteOutputError(int error) {
  if (output_error == 0) output_error = error;
}

/// Gives each closed standard stream a descriptor that refuses the direction in which the stream is used.
void occupyStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() takes the lowest free descriptor, which is the stream's
    if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

/// fmt::print() throws where a stream does not take the text.
int statusOf(const std::function<int()>& work) {
  try {
    return work();
  } catch (const std::system_error& error) {
    const bool output = std::ferror(stdout) != 0;
    if (!output && std::ferror(stderr) == 0) throw;
    if (output) noteOutputError(error.code().value());
    return 1;
  }
}

/// Also catches errors that a disk reports only at the end, as over a network.
bool closeOutput() {
  if (!flushOutput()) return false;
  if (::close(STDOUT_FILENO) == 0 || errno == EBADF) return true;
  noteOutputError(errno);
  return false;
}

}  // namespace

bool flushOutput() {
  errno = 0;
  if (std::fflush(stdout) != 0) noteOutputError(errno);
  return output_error == 0 && std::ferror(stdout) == 0;
}

int runProgram(std::string_view name, const std::function<int()>& work) {
  occupyStandardStreams();
  std::signal(SIGXFSZ, SIG_IGN);
  const int status = statusOf(work);
  if (closeOutput() || output_error == EPIPE) return status;
  const std::string reason = output_error == 0 ? "" : std::string(": ") + std::strerror(output_error);
  std::fputs(fmt::format("{}: cannot write to standard output{}\n", name, reason).c_str(), stderr);
  return status == 0 ? 1 : status;
}

}  // namespace hapticd::config
