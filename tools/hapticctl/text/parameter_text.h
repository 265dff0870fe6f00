// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <string>
#include <vector>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// The rows of GetParameters that the words name: a parameter by its name, or all parameters of a group by
/// what their names begin with up to a dot ("force" or "force."). Without words all rows. In the order of the
/// words, each parameter once. Errors: the words that name nothing.
std::expected<Json, std::vector<std::string>> parametersNamed(const std::vector<std::string>& words,
                                                              const Json& parameters);

/// The rows of GetParameters as a table with what is allowed and what each parameter means. columns: of the
/// terminal, as Table::text() takes it.
std::string parameterTableText(const Json& parameters, std::size_t columns);

/// "force.stiffness_n_per_m = 500 N/m".
std::string parameterLine(const Json& parameter);

/// "500 N/m". value: of the parameter, as text.
std::string withUnit(const std::string& value, const Json& parameter);

}  // namespace hapticd::tools
