// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"

namespace hapticd::config {

/// A value as written by people and programs; a choice is the string of one of its alternatives, as is a
/// number that is one of its words ("auto"). Parameters have none of the last two.
using Value = std::variant<bool, std::int64_t, double, std::string, rt::Vec3, std::vector<rt::Vec3>>;

/// What a row holds. Those after `text` are in the rows of additions only.
enum class Kind {
  boolean,
  integer,
  number,
  choice,
  text,
  name,        ///< of a fixture, region or frame
  frame,       ///< name of the frame of vectors
  hash,        ///< SHA-256 of a file
  vector,      ///< three numbers, each within the range
  direction,   ///< a vector of any length except zero
  quaternion,  ///< [x, y, z, w] of length 1: another way to give the angles `rotation_deg`, which only reads
  points,      ///< of a path
};
constexpr auto wordsOf(Kind) {
  return rt::words<Kind>("boolean", "integer", "number", "choice", "text", "name", "frame", "hash", "vector",
                         "direction", "quaternion", "points");
}

/// When a new value takes effect.
enum class Effect {
  live,     ///< immediately, in the running loop
  restart,  ///< at the next start of the daemon
};

/// Which new value of a parameter takes a limit of the force away, lets stale data act for longer, or warns
/// less: nobody may get that unasked while he holds the handle (config/conflicts.h).
enum class Looser {
  never,           ///< it is no limit
  higher,          ///< of words: the one that is later in the list; true
  lower,           ///< of words: the one that is earlier; false
  higher_or_zero,  ///< 0 stands for no limit at all
};

/// What everybody knows about a value that people may give.
struct Row {
  std::string_view name;  ///< ending in the unit if it is a dimensional number
  Kind kind;
  std::string_view unit;  ///< e.g. "N/m"; empty for pure numbers and words
  double minimum;         ///< inclusive; of numbers, integers and the components of vectors
  double maximum;         ///< inclusive; likewise
  /// For choices; of a number, the words that it may be instead.
  std::span<const std::string_view> choices;
  std::span<const std::string_view> choice_help;  ///< one line for each of `choices`, or empty
  std::string_view help;                          ///< one line

  /// Returns e.g. "20..5000 N/m", "one of: paper, factory, custom", "true or false", "text".
  std::string range() const;
  /// Returns what is wrong with a number, which is written as `shown`: "7 N is out of range"; empty: nothing.
  std::string problemOf(double number, std::string_view shown) const;
};

/// The row of a parameter: everything that the YAML loader, the control API and hapticctl know about it.
struct Parameter : Row {  // the name is "group.name"
  Effect effect;
  std::string_view symbol;  ///< the paper's, or empty
  Value (*get)(const Settings&);
  void (*set)(Settings&, const Value&);  ///< `value` must have passed check()
  Looser looser = Looser::never;

  /// Returns the part of the name in front of the dot, and the part behind it.
  std::string_view group() const { return name.substr(0, name.find('.')); }
  std::string_view nameInGroup() const { return name.substr(name.find('.') + 1); }
  /// Returns the value in a default-constructed Settings.
  Value defaultValue() const;
  /// Returns `value` converted to the type of this parameter (an integer is accepted as a number), or why it
  /// is refused.
  base::Result<Value> check(const Value& value) const;
  /// Parses and checks a text, as in `--set name=value`.
  base::Result<Value> parse(std::string_view text) const;
};

/// Returns the parameters of a box in the order in which they are shown: the reference for users.
std::span<const Parameter> parameterTable();

/// Returns the parameters of what stands in for a device, which only tests and demonstrations set. Wherever a
/// parameter is named they are like the others, but lists for users leave them out.
std::span<const Parameter> standInParameters();

/// Returns both, those of the box first.
std::span<const Parameter> allParameters();

/// Returns the groups of all parameters, each once.
std::vector<std::string_view> parameterGroups();

/// Returns null if there is no parameter of this name, in neither of the two.
const Parameter* findParameter(std::string_view name);

/// Returns the error for the name of no parameter, with suggestions.
base::Error unknownParameter(std::string_view name);

/// Sets one parameter from text, as in `--set name=value`.
base::Result<void> setFromText(Settings& settings, std::string_view name_and_value);

/// Checks the rules between parameters (near below far, the window covers the HIP's reach, min_points not
/// above max_points, ...). Returns every violated rule, or none.
std::vector<base::Error> checkTogether(const Settings& settings);

/// Returns the shortest form that reads back as the same value: "500", "0.04", "true", "paper", "[0, 0,
/// 0.1]".
std::string toText(const Value& value);

}  // namespace hapticd::config
