// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "config/value_text.h"

namespace hapticd::daemon {
namespace {

/// systemd.exec(5): JOURNAL_STREAM names device and inode of the stream that goes to the journal; a child
/// whose standard error was redirected inherits the variable all the same.
bool standardErrorIsJournal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

iovec vectorOf(std::string& field) {
  return {field.data(), field.size()};
}

void sendToJournal(const JournalEntry& entry) {
  std::vector<std::string> fields{"MESSAGE=" + config::printable(entry.text),
                                  fmt::format("PRIORITY={}", static_cast<int>(entry.priority))};
  if (entry.event) fields.push_back(fmt::format("HAPTICD_EVENT={}", rt::wordOf(*entry.event)));
  for (const auto& [name, value] : entry.fields)
    fields.push_back(fmt::format("HAPTICD_{}={}", name, config::printable(value)));
  std::vector<iovec> vectors;
  for (std::string& field : fields) vectors.push_back(vectorOf(field));
  ::sd_journal_sendv(vectors.data(), static_cast<int>(vectors.size()));
}

}  // namespace

void writeToJournal(const JournalEntry& entry) {
  static const bool journal = standardErrorIsJournal();
  if (journal) return sendToJournal(entry);
  const std::string line = fmt::format("hapticd: {}\n", config::printable(entry.text));
  std::fputs(line.c_str(), stderr);  // fmt::print throws where nobody reads
}

}  // namespace hapticd::daemon
