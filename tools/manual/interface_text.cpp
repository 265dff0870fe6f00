// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/interface_text.h"

#include <algorithm>
#include <cctype>
#include <utility>

namespace hapticd::tools {
namespace {

using config::Error;
using config::Result;

bool isBlank(char character) {
  return std::isspace(static_cast<unsigned char>(character)) != 0;
}

bool isOfAName(char character) {
  return std::isalnum(static_cast<unsigned char>(character)) != 0 || character == '_' || character == '.';
}

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  bool atEnd() {
    skipBlanks();
    return place_ == text_.size();
  }
  /// Takes the comment above the next element, as one line.
  std::string takeComment() {
    skipBlanks();
    return std::exchange(comment_, {});
  }
  std::string takeName() {
    skipBlanks();
    const std::size_t begin = place_;
    while (place_ < text_.size() && isOfAName(text_[place_])) ++place_;
    return std::string(text_.substr(begin, place_ - begin));
  }
  bool take(std::string_view sign) {
    skipBlanks();
    if (!text_.substr(place_).starts_with(sign)) return false;
    place_ += sign.size();
    return true;
  }
  /// A type up to the comma or bracket behind it, without comments and line ends.
  std::string takeType() {
    std::string type;
    for (int depth = 0; !atEnd(); ++place_) {
      const char character = text_[place_];
      if (depth == 0 && (character == ',' || character == ')')) break;
      depth += character == '(' ? 1 : character == ')' ? -1 : 0;
      type += character;
      if (character == ',' || character == ':') type += ' ';
    }
    comment_.clear();
    return type;
  }
  std::size_t line() const {
    return 1 + static_cast<std::size_t>(std::ranges::count(text_.substr(0, place_), '\n'));
  }

 private:
  void skipBlanks() {
    while (place_ < text_.size()) {
      if (isBlank(text_[place_])) {
        ++place_;
      } else if (text_[place_] == '#') {
        takeCommentLine();
      } else {
        return;
      }
    }
  }
  void takeCommentLine() {
    const std::size_t end = std::min(text_.find('\n', place_), text_.size());
    const std::size_t words = std::min(text_.find_first_not_of("# ", place_), end);
    if (words < end)
      comment_ += (comment_.empty() ? "" : " ") + std::string(text_.substr(words, end - words));
    place_ = end;
  }

  std::string_view text_;
  std::size_t place_ = 0;
  std::string comment_;
};

Error wrong(const Reader& reader, const std::string& what) {
  return {"line " + std::to_string(reader.line()), what, "see varlink.org/Interface-Definition"};
}

Result<std::vector<InterfaceField>> readFields(Reader& reader) {
  if (!reader.take("(")) return std::unexpected(wrong(reader, "'(' is missing"));
  std::vector<InterfaceField> fields;
  if (reader.take(")")) return fields;
  do {
    InterfaceField field;
    field.comment = reader.takeComment();
    field.name = reader.takeName();
    if (field.name.empty()) return std::unexpected(wrong(reader, "the name of a field is missing"));
    if (reader.take(":")) field.type = reader.takeType();
    fields.push_back(std::move(field));
  } while (reader.take(","));
  if (!reader.take(")")) return std::unexpected(wrong(reader, "')' is missing"));
  return fields;
}

Result<InterfaceItem> readItem(Reader& reader) {
  InterfaceItem item;
  item.comment = reader.takeComment();
  item.kind = reader.takeName();
  if (item.kind != "type" && item.kind != "method" && item.kind != "error") {
    return std::unexpected(wrong(reader, "'" + item.kind + "' where type, method or error is expected"));
  }
  item.name = reader.takeName();
  auto fields = readFields(reader);
  if (!fields) return std::unexpected(fields.error());
  item.fields = std::move(*fields);
  if (item.kind != "method") return item;
  if (!reader.take("->")) return std::unexpected(wrong(reader, "'->' is missing"));
  auto answers = readFields(reader);
  if (!answers) return std::unexpected(answers.error());
  item.answers = std::move(*answers);
  return item;
}

}  // namespace

Result<InterfaceText> parseInterface(std::string_view text) {
  Reader reader(text);
  InterfaceText interface;
  interface.comment = reader.takeComment();
  if (reader.takeName() != "interface")
    return std::unexpected(wrong(reader, "the line 'interface' is missing"));
  interface.name = reader.takeName();
  while (!reader.atEnd()) {
    auto item = readItem(reader);
    if (!item) return std::unexpected(item.error());
    interface.items.push_back(std::move(*item));
  }
  return interface;
}

}  // namespace hapticd::tools
