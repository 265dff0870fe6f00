// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/watch/watch.h"

namespace hapticd::test {

constinit const Sight kSight{.allocations = false,
                             .aligned_allocations = false,
                             .locks = false,
                             .exceptions = false,
                             .said_instead =
                                 "nothing by the test itself: RealtimeSanitizer watches, and ends "
                                 "the process at the first allocation, lock or blocking call"};

}  // namespace hapticd::test
