// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/base/journal_entry.h"

namespace hapticd::daemon {

/// Writes to the journal with its fields where standard error goes there, else one line to standard error.
/// Output that nobody reads is no error: the daemon goes on.
/// Thread: any.  Progress: blocking.
void writeToJournal(const JournalEntry& entry);

}  // namespace hapticd::daemon
