// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/varlink_message.h"

#include <set>
#include <utility>
#include <vector>

namespace hapticd::daemon {
namespace {

/// Refuses what the parser alone would accept: deep nesting, and names that appear twice in one object.
class StructureCheck final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    return names_.back().insert(name).second || refuse("the name '" + name + "' appears twice");
  }
  bool parse_error(std::size_t position, const std::string&, const Json::exception& error) override {
    constexpr int kNumberTooLarge = 406;
    if (error.id == kNumberTooLarge) return refuse("it has a number that is too large");
    return refuse("not valid JSON from byte " + std::to_string(position) + " on");
  }

  std::string takeProblem() { return std::move(problem_); }

 private:
  bool enter() {
    names_.emplace_back();
    return names_.size() <= kMaxCallDepth || refuse("nested too deeply");
  }
  bool leave() {
    names_.pop_back();
    return true;
  }
  bool refuse(std::string problem) {
    problem_ = std::move(problem);
    return false;
  }

  std::vector<std::set<std::string>> names_;  // of each open object; empty for an array
  std::string problem_;
};

bool readFlag(const Json& value, bool& flag) {
  if (!value.is_boolean()) return false;
  flag = value.get<bool>();
  return true;
}

bool readParameters(Json& value, Json& parameters) {
  if (value.is_null()) return true;
  if (!value.is_object()) return false;
  parameters = std::move(value);
  return true;
}

/// Reads a field into `call`; returns false if it is unknown or of the wrong type.
bool readField(const std::string& name, Json& value, Call& call) {
  if (name == "parameters") return readParameters(value, call.parameters);
  if (name == "oneway") return readFlag(value, call.oneway);
  if (name == "more") return readFlag(value, call.more);
  if (name == "upgrade") return readFlag(value, call.upgrade);
  if (name != "method" || !value.is_string()) return false;
  call.method = value.get<std::string>();
  return true;
}

}  // namespace

std::expected<Call, std::string> parseCall(std::string_view message) {
  StructureCheck check;
  if (!Json::sax_parse(message.begin(), message.end(), &check)) return std::unexpected(check.takeProblem());
  Json document = Json::parse(message.begin(), message.end(), nullptr, /*allow_exceptions=*/false);
  if (!document.is_object()) return std::unexpected("not an object");

  Call call;
  for (auto field = document.begin(); field != document.end(); ++field) {
    if (!readField(field.key(), field.value(), call)) {
      return std::unexpected("the field '" + field.key() + "' is unknown or of the wrong type");
    }
  }
  if (!document.contains("method")) return std::unexpected("no method");
  if (call.oneway && call.more) return std::unexpected("both oneway and more");
  return call;
}

Reply malformedCall(std::string_view reason) {
  constexpr std::size_t kMaxReasonLength = 200;
  std::string text;
  for (const char byte : reason.substr(0, kMaxReasonLength)) text += byte >= ' ' && byte <= '~' ? byte : '?';
  if (reason.size() > kMaxReasonLength) text += " ...";
  return {"io.hapticd.Status.MalformedCall", {{"reason", std::move(text)}}};
}

std::string serialise(const Reply& reply) {
  OrderedJson message = OrderedJson::object();
  if (!reply.error.empty()) message["error"] = reply.error;
  message["parameters"] = reply.parameters;
  if (reply.continues) message["continues"] = true;
  std::string text = message.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
  text.push_back('\0');
  return text;
}

}  // namespace hapticd::daemon
