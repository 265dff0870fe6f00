// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "tests/system/fake_daemon.h"

namespace hapticd::test {

/// The status of a box on which all is well, as GetStatus answers it.
nlohmann::json goodStatus();

/// The same with `patch` merged into it (RFC 7396).
nlohmann::json statusWith(const nlohmann::json& patch);

/// Answers to every call of the control API that hapticctl knows, on a box on which all is well.
void answerEverything(FakeDaemon& daemon);

/// A daemon before traces, profiles, events, snapshots and registration.
void answerAsAnOldDaemon(FakeDaemon& daemon);

/// The replies of GetSnapshot: a wall with a raw disparity everywhere but in the first row, seen by a camera
/// at the world's origin; `rows_per_reply` divides 480.
FakeAnswer snapshotOfAWall(int raw, int rows_per_reply);

}  // namespace hapticd::test
