// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticd-view/recorded/recorded_session.h"

namespace hapticd::tools::view {

/// The message `timeline` of the protocol of `/live`: modes, faults and contacts as periods, events and an
/// experimenter's marks as moments, and where the force was largest. Contacts that follow each other closely
/// are one, and short periods of modes belong to the one before, so that there are at most 1000 of each; of
/// the events the first 1000 are in it.
Json timelineOf(const RecordedSession& session);

}  // namespace hapticd::tools::view
