// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_survey.h"

#include <algorithm>
#include <string>

namespace hapticd::drivers::mcap {
namespace {

/// Messages outside of chunks are grouped into parts of this size.
constexpr std::uint64_t kMaxLooseBytes = 1 << 20;

class Surveying {
 public:
  Surveying(Scanner& scanner, SurveyVisitor& visitor) : scanner_(scanner), visitor_(visitor) {}

  Survey run() {
    while (true) {
      const auto head = scanner_.head();
      if (!head) return ended(head.error());
      if (head->opcode == Opcode::data_end || head->opcode == Opcode::footer) return std::move(found_);
      if (const auto taken = take(*head); !taken) return ended(taken.error());
      scanner_.jump(head->end());
    }
  }

 private:
  Survey ended(const Fault& fault) {
    found_.fault = fault;
    return std::move(found_);
  }

  std::expected<void, Fault> take(const RecordHead& head) {
    switch (head.opcode) {
      case Opcode::chunk:
        return chunk(head);
      case Opcode::message:
        return message(head);
      case Opcode::schema:
      case Opcode::channel:
      case Opcode::metadata:
      case Opcode::attachment:
        return whole(head);
      default:
        return {};
    }
  }

  std::expected<void, Fault> whole(const RecordHead& head) {
    const auto record = scanner_.next();
    if (!record) return std::unexpected(record.error());
    const bool defines = head.opcode == Opcode::schema || head.opcode == Opcode::channel;
    const std::string wrong = defines ? visitor_.definition(*record) : visitor_.companion(*record);
    if (!wrong.empty()) return std::unexpected(scanner_.damaged(head.offset, wrong));
    return {};
  }

  /// Reads the time at offset `at` of the record's content.
  std::expected<std::uint64_t, Fault> time(const RecordHead& head, std::size_t at) {
    std::string bytes;
    if (auto read = scanner_.read(head.offset + kRecordHeadBytes + at, sizeof(std::uint64_t), bytes); !read) {
      return std::unexpected(read.error());
    }
    return ByteReader(bytes).number<std::uint64_t>();
  }

  std::expected<void, Fault> chunk(const RecordHead& head) {
    const auto start_ns = time(head, 0), end_ns = time(head, sizeof(std::uint64_t));
    if (!start_ns || !end_ns) return std::unexpected(start_ns ? end_ns.error() : start_ns.error());
    const bool empty = *start_ns == 0 && *end_ns == 0;  // an empty chunk may have any time
    const std::uint64_t before_ns = found_.stretches.empty() ? 0 : found_.stretches.back().start_ns;
    found_.stretches.push_back({head.offset, head.end() - head.offset, empty ? before_ns : *start_ns, true});
    return {};
  }

  std::expected<void, Fault> message(const RecordHead& head) {
    constexpr std::size_t kTimeAt = sizeof(std::uint16_t) + sizeof(std::uint32_t);  // channel, sequence
    const auto time_ns = time(head, kTimeAt);
    if (!time_ns) return std::unexpected(time_ns.error());
    const std::uint64_t bytes = head.end() - head.offset;
    Stretch* const last = found_.stretches.empty() ? nullptr : &found_.stretches.back();
    if (last != nullptr && !last->chunk && last->end() == head.offset && last->bytes < kMaxLooseBytes) {
      last->bytes += bytes;
      last->start_ns = std::min(last->start_ns, *time_ns);
    } else {
      found_.stretches.push_back({head.offset, bytes, *time_ns, false});
    }
    return {};
  }

  Scanner& scanner_;
  SurveyVisitor& visitor_;
  Survey found_;
};

}  // namespace

bool Survey::inOrderOfTime() const {
  return std::ranges::is_sorted(stretches, {}, &Stretch::start_ns);
}

Survey survey(Scanner& scanner, SurveyVisitor& visitor) {
  return Surveying(scanner, visitor).run();
}

}  // namespace hapticd::drivers::mcap
