// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "tests/system/fake_daemon.h"

namespace hapticd::test {

/// Returns the status of a box without problems, as in the reply to GetStatus.
nlohmann::json goodStatus();

/// Returns goodStatus() with `patch` merged into it (RFC 7396).
nlohmann::json statusWith(const nlohmann::json& patch);

/// Sets replies to every call of the control API that hapticctl uses, of a box without problems.
void answerEverything(FakeDaemon& daemon);

/// Sets the replies of a daemon without traces, profiles, events, snapshots and registration.
void answerAsAnOldDaemon(FakeDaemon& daemon);

/// The replies of GetSnapshot: a wall with a raw disparity everywhere but in the first row, seen by a camera
/// at the world's origin; `rows_per_reply` divides 480.
FakeAnswer snapshotOfAWall(int raw, int rows_per_reply);

}  // namespace hapticd::test
