// SPDX-License-Identifier: Apache-2.0
#include "interface_definition.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace hapticd::daemon::test {
namespace {

using Kind = IdlType::Kind;

bool isLetter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}
bool isLetterOrDigit(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// A letter, then letters and digits, with single separators between them.
bool isWord(std::string_view name, char separator) {
  if (name.empty() || !isLetter(name.front()) || name.back() == separator) return false;
  for (std::size_t i = 1; i < name.size(); ++i) {
    const bool separates = name[i] == separator && name[i - 1] != separator;
    if (!isLetterOrDigit(name[i]) && !separates) return false;
  }
  return true;
}

bool isFieldName(std::string_view name) {
  return isWord(name, '_');
}
bool isMemberName(std::string_view name) {
  return !name.empty() && std::isupper(static_cast<unsigned char>(name.front())) != 0 &&
         std::ranges::all_of(name, isLetterOrDigit);
}
bool isInterfaceName(std::string_view name) {
  return isWord(name, '.') && name.contains('.');
}

class Parser {
 public:
  explicit Parser(std::string_view text) : rest_(text) {}

  bool atEnd() {
    skip();
    return rest_.empty();
  }
  bool take(std::string_view symbol) {
    skip();
    if (!rest_.starts_with(symbol)) return false;
    rest_.remove_prefix(symbol.size());
    return true;
  }
  void expect(std::string_view symbol) {
    if (!take(symbol)) fail("expected " + std::string(symbol));
  }
  std::string word(bool (*has_form)(std::string_view)) {
    skip();
    std::size_t length = 0;
    while (length < rest_.size() &&
           (isLetterOrDigit(rest_[length]) || std::string_view("._-").contains(rest_[length]))) {
      // "->" is not part of a name
      if (rest_.substr(length).starts_with("->")) break;
      ++length;
    }
    const std::string name(rest_.substr(0, length));
    if (!has_form(name)) fail("not a name: '" + name + "'");
    rest_.remove_prefix(length);
    return name;
  }

  IdlType type() {
    if (take("?")) return wrap(Kind::nullable);
    if (take("[]")) return wrap(Kind::array);
    if (take("[string]")) return wrap(Kind::map);
    skip();
    if (rest_.starts_with("(")) return structure();
    const std::string name = word(isFieldName);
    const bool basic =
        name == "bool" || name == "int" || name == "float" || name == "string" || name == "object";
    return {basic ? Kind::basic : Kind::named, name, nullptr, {}, {}};
  }

  /// A structure or an enumeration.
  IdlType structure() {
    IdlType result{Kind::structure, "", nullptr, {}, {}};
    expect("(");
    if (take(")")) return result;
    do {
      const std::string name = word(isFieldName);
      if (take(":")) {
        result.fields.emplace_back(name, type());
      } else {
        result.words.push_back(name);
      }
    } while (take(","));
    expect(")");
    if (!result.words.empty() && !result.fields.empty()) fail("neither a structure nor an enumeration");
    if (!result.words.empty()) result.kind = Kind::enumeration;
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(what + " at: " + std::string(rest_.substr(0, 60)));
  }
  void skip() {
    while (!rest_.empty()) {
      if (rest_.front() == '#') {
        rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
      } else if (std::isspace(static_cast<unsigned char>(rest_.front()))) {
        rest_.remove_prefix(1);
      } else {
        return;
      }
    }
  }
  IdlType wrap(Kind kind) { return {kind, "", std::make_shared<IdlType>(type()), {}, {}}; }

  std::string_view rest_;
};

bool isBasic(const nlohmann::json& value, const std::string& name) {
  if (name == "bool") return value.is_boolean();
  if (name == "int") return value.is_number_integer();
  if (name == "float") return value.is_number();
  if (name == "string") return value.is_string();
  return !value.is_null();
}

}  // namespace

InterfaceDefinition::InterfaceDefinition(std::string_view text) {
  Parser parser(text);
  parser.expect("interface");
  name = parser.word(isInterfaceName);
  while (!parser.atEnd()) {
    if (parser.take("type")) {
      const std::string member = parser.word(isMemberName);
      types[member] = parser.structure();
    } else if (parser.take("error")) {
      const std::string member = parser.word(isMemberName);
      errors[member] = parser.structure();
    } else {
      parser.expect("method");
      const std::string member = parser.word(isMemberName);
      inputs[member] = parser.structure();
      parser.expect("->");
      outputs[member] = parser.structure();
    }
  }
}

std::string InterfaceDefinition::mismatch(const nlohmann::json& value, const IdlType& type,
                                          const std::string& path) const {
  switch (type.kind) {
    case Kind::basic:
      return isBasic(value, type.name) ? "" : path + ": not " + type.name + ": " + value.dump();
    case Kind::named:
      return types.contains(type.name) ? mismatch(value, types.at(type.name), path)
                                       : path + ": no type " + type.name;
    case Kind::nullable:
      return value.is_null() ? "" : mismatch(value, *type.element, path);
    case Kind::enumeration:
      return value.is_string() && std::ranges::find(type.words, value.get<std::string>()) != type.words.end()
                 ? ""
                 : path + ": not one of the words: " + value.dump();
    case Kind::structure:
      return structureMismatch(value, type, path);
    case Kind::array:
    case Kind::map:
      break;
  }
  if (type.kind == Kind::array ? !value.is_array() : !value.is_object()) return path + ": not a list or map";
  for (const auto& item : value) {
    if (const std::string found = mismatch(item, *type.element, path + "[]"); !found.empty()) return found;
  }
  return "";
}

std::string InterfaceDefinition::structureMismatch(const nlohmann::json& value, const IdlType& type,
                                                   const std::string& path) const {
  if (!value.is_object()) return path + ": not an object";
  for (const auto& [field, field_type] : type.fields) {
    if (!value.contains(field)) return path + ": no field " + field;
    const std::string found = mismatch(value[field], field_type, path + "." + field);
    if (!found.empty()) return found;
  }
  return value.size() == type.fields.size() ? "" : path + ": more fields than described: " + value.dump();
}

}  // namespace hapticd::daemon::test
