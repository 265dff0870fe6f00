// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <vector>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The table of a reply of ListFixtures. `columns`: of the terminal.
std::string fixtureListText(const Json& reply, std::size_t columns);
/// The table of a reply of ListRegions.
std::string regionListText(const Json& reply, std::size_t columns);

/// The table of a reply of ListFrames.
std::string frameListText(const Json& reply, std::size_t columns);
/// An entry of ListFrames, each member on a line of its own.
std::string frameText(const Json& entry);

/// An entry of the lists of fixtures or regions, each member on a line of its own.
std::string additionText(const Json& entry);

/// "2 of 3 fixtures enabled, nearest nerve at 3.2 mm, in contact: nerve, 1.20 N; guidance 0.15 N"; empty
/// where there are none.
std::string fixturesText(const Json& status);
/// "phantom live, tool lost for 2.1 s"; empty where there are none.
std::string framesText(const Json& status);
/// "3 tissue regions, in contact: nodule; measured stiffness: 12 samples, 0 too fast, 1 outside"; empty where
/// there are none.
std::string tissueText(const Json& status);
/// "500 N/m" for a stiffness in effect, with what limits it where it is automatic and the noise of the
/// surface where it is known.
std::string surfaceStiffnessText(const Json& status);

/// The rows of GetParameters that the words name: a parameter by its name, or all parameters of a group by
/// what their names begin with up to a dot ("force" or "force."). Without words all rows. In the order of the
/// words, each parameter once. Errors: the words that name nothing.
std::expected<Json, std::vector<std::string>> parametersNamed(const std::vector<std::string>& words,
                                                              const Json& parameters);

/// The rows of GetParameters whose name or meaning has all of the words, upper and lower case alike.
Json parametersWith(const std::vector<std::string>& words, const Json& parameters);

/// The rows of GetParameters as a table with what is allowed and what each parameter means. columns: of the
/// terminal, as Table::text() takes it.
std::string parameterTableText(const Json& parameters, std::size_t columns);

/// "force.stiffness_n_per_m = 500 N/m".
std::string parameterLine(const Json& parameter);

/// "500 N/m". value: of the parameter, as text.
std::string withUnit(const std::string& value, const Json& parameter);

/// The traces of a folder that `trace list` shows, and their order.
struct TraceListOptions {
  std::string label = {};                     ///< part of the name; empty: any
  std::optional<std::int64_t> since_ns = {};  ///< begun at that time or later, CLOCK_REALTIME
  std::optional<std::int64_t> until_ns = {};  ///< begun at that time or before
  std::string state = {};                     ///< writing, finished, damaged or kept; empty: any
  std::string sort = "time";                  ///< time: of the begin; name; size
  bool reverse = false;
};

/// The traces of a reply of ListTraces that the options choose, in their order.
Json chosenTraces(const Json& reply, const TraceListOptions& options);

/// When a trace began, CLOCK_REALTIME in nanoseconds; of an older hapticd the time of its last change.
/// Nothing where the clock had not been set.
std::optional<double> traceBegin_ns(const Json& trace);

/// When the newest of the traces began whose clock had been set; 0: none.
std::int64_t latestBegin_ns(const Json& reply);

/// The traces as a table, with their number and size below. reply: the whole reply they were chosen from,
/// which has their total number; now_ns: for ages, of which there are none without it; columns: of the
/// terminal.
std::string traceListText(const Json& traces, const Json& reply, std::optional<std::int64_t> now_ns,
                          std::size_t columns);

/// "3 traces, 1.2 GB".
std::string traceSumText(const Json& traces);

/// The plan of `trace delete`.
struct TraceDeletion {
  Json to_delete = Json::array();     ///< as in the reply
  std::vector<std::string> problems;  ///< of named traces that cannot be deleted: name and reason
  std::vector<std::string> staying;   ///< old traces, or of an unknown age, that stay: name and reason
};

/// Plans the deletion of named traces. Problems: there is no such trace, it is kept or is being written.
TraceDeletion deletionOf(const std::vector<std::string>& names, const Json& reply);

/// Plans the deletion of all finished traces that began before then, without those that are kept or whose age
/// is not known.
TraceDeletion deletionBefore(std::int64_t time_ns, const Json& reply);

}  // namespace hapticd::tools
