// SPDX-License-Identifier: Apache-2.0
#include "config/base/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <system_error>

namespace hapticd::base {
namespace {

/// errno of the first failed write to standard output; 0: none.
int output_error = 0;

void noteOutputError(int error) {
  if (output_error == 0) output_error = error;
}

/// Replaces a closed standard stream by a descriptor that fails for its purpose.
void occupyStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // takes the lowest free number, which is that of the stream
    if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

/// fmt::print() throws if a stream does not accept the text, and the standard library where memory ends.
int statusOf(std::string_view name, const std::function<int()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    std::fputs(
        fmt::format("{}: takes more memory than there is (end other programs, or raise the limit)\n", name)
            .c_str(),
        stderr);
    return 1;
  } catch (const std::system_error& error) {
    const bool output = std::ferror(stdout) != 0;
    if (!output && std::ferror(stderr) == 0) throw;
    if (output) noteOutputError(error.code().value());
    return 1;
  }
}

/// Includes errors that the file system reports only at the end, e.g. over a network.
bool closeOutput() {
  if (!flushOutput()) return false;
  if (::close(STDOUT_FILENO) == 0 || errno == EBADF) return true;
  noteOutputError(errno);
  return false;
}

}  // namespace

void writeOutput(std::string_view text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) noteOutputError(errno);
}

bool flushOutput() {
  errno = 0;
  if (std::fflush(stdout) != 0) noteOutputError(errno);
  return output_error == 0 && std::ferror(stdout) == 0;
}

int runProgram(std::string_view name, const std::function<int()>& work) {
  occupyStandardStreams();
  std::signal(SIGXFSZ, SIG_IGN);
  const int status = statusOf(name, work);
  if (closeOutput() || output_error == EPIPE) return status;
  const std::string reason = output_error == 0 ? "" : std::string(": ") + std::strerror(output_error);
  std::fputs(fmt::format("{}: cannot write to standard output{}\n", name, reason).c_str(), stderr);
  return status == 0 ? 1 : status;
}

}  // namespace hapticd::base
