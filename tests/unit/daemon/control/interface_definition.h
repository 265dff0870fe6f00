// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hapticd::daemon::test {

/// A type of the Varlink interface language.
struct IdlType {
  enum class Kind { basic, named, array, map, nullable, structure, enumeration };
  Kind kind = Kind::basic;
  std::string name;                                     ///< of a basic or named type
  std::shared_ptr<IdlType> element;                     ///< of an array, map or nullable type
  std::vector<std::pair<std::string, IdlType>> fields;  ///< of a structure
  std::vector<std::string> words;                       ///< of an enumeration
};

/// An interface text, read by the grammar of varlink.org and by nothing of the daemon.
class InterfaceDefinition {
 public:
  /// Throws std::runtime_error with the place where the text is not an interface definition.
  explicit InterfaceDefinition(std::string_view text);

  std::string name;
  std::map<std::string, IdlType> types;
  std::map<std::string, IdlType> inputs;   ///< of the methods
  std::map<std::string, IdlType> outputs;  ///< of the methods
  std::map<std::string, IdlType> errors;

  /// Returns where `value` is not of `type` ("status.loop: no field x"); empty if it is.
  std::string mismatch(const nlohmann::json& value, const IdlType& type, const std::string& path = "") const;

 private:
  std::string structureMismatch(const nlohmann::json& value, const IdlType& type,
                                const std::string& path) const;
};

}  // namespace hapticd::daemon::test
