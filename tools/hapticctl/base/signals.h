// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::tools {

/// Blocks the signals that end the program (SIGINT, SIGTERM, SIGHUP, SIGQUIT), report a new size of the
/// terminal (SIGWINCH) or stop the program for a while (SIGTSTP), and returns a descriptor that becomes
/// readable when one arrives; -1 on failure. From then on a broken pipe is an error of the write.
int takeSignals();

/// Takes the next signal from the descriptor; 0 if there is none.
int nextSignal(int descriptor);

}  // namespace hapticd::tools
