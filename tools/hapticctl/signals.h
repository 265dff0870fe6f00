// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::tools {

/// A descriptor that becomes readable when the program is to end (SIGINT, SIGTERM, SIGHUP, SIGQUIT), the
/// terminal changes its size (SIGWINCH) or the program is to stop for a while (SIGTSTP). From then on these
/// signals do nothing else, and a broken pipe is an error of the write. -1: there is none.
int takeSignals();

/// The number of the next signal; 0 if none has come.
int nextSignal(int descriptor);

}  // namespace hapticd::tools
