// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/foxglove/make_session.h"

namespace hapticd::tools::view {

std::unique_ptr<Session> makeFoxgloveSession(Source&, MessageSink&, std::string_view) {
  return nullptr;
}

}  // namespace hapticd::tools::view
