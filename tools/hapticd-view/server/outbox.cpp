// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/outbox.h"

#include <algorithm>

namespace hapticd::tools::view {

Outbox::Outbox(All& all) : all_(all) {
  all_.push_back(this);
}

Outbox::~Outbox() {
  all_.remove(this);
}

void Outbox::add(Message message, MessageKey key) {
  if (key == MessageKey::queued) return addQueued(std::move(message));
  addKeyed(std::move(message), key);
}

void Outbox::addQueued(Message message) {
  queued_bytes_ += message.size();
  queue_.push_back(std::move(message));
  while (queue_.size() > MessageSink::kMaxQueued ||
         (queued_bytes_ > MessageSink::kMaxQueuedBytes && queue_.size() > 1)) {
    queued_bytes_ -= queue_.front().size();
    queue_.pop_front();
    ++dropped_;
  }
}

/// A newer message takes the place of the one that it replaces, so that each key gets its turn.
void Outbox::addKeyed(Message message, MessageKey key) {
  if (const auto before = find(key); before != keyed_.end()) {
    keyed_bytes_ -= before->second.size();
    before->second = {};
    ++replaced_;
  } else {
    keyed_.emplace_back(key, Message());
  }
  const bool has_room = makeRoom(message.size());
  const auto place = find(key);
  if (!has_room) {
    erase(place);
    ++dropped_;
    return;
  }
  keyed_bytes_ += message.size();
  place->second = std::move(message);
}

/// False: although no other keyed message waits there is no room among all clients.
bool Outbox::makeRoom(std::size_t bytes) {
  while (keyed_bytes_ > 0 && keyed_bytes_ + bytes > kMaxKeyedBytes) dropLargest();
  for (;;) {
    std::size_t used = 0;
    for (const Outbox* each : all_) used += each->keyed_bytes_ + each->transmittedBytes();
    if (used + bytes <= kMaxKeyedBytesOfAll) return true;
    Outbox* const fullest = *std::ranges::max_element(all_, {}, &Outbox::keyed_bytes_);
    if (fullest->keyed_bytes_ == 0) return false;
    fullest->dropLargest();
  }
}

/// Of equally large ones the one that has waited longest.
void Outbox::dropLargest() {
  erase(std::ranges::max_element(keyed_, {}, [](const auto& entry) { return entry.second.size(); }));
  ++dropped_;
}

void Outbox::erase(Keyed::iterator entry) {
  keyed_bytes_ -= entry->second.size();
  keyed_.erase(entry);
}

Outbox::Keyed::iterator Outbox::find(MessageKey key) {
  return std::ranges::find(keyed_, key, [](const auto& entry) { return entry.first; });
}

bool Outbox::waits(MessageKey key) const {
  if (key == MessageKey::queued) return !queue_.empty();
  return std::ranges::any_of(keyed_, [key](const auto& entry) { return entry.first == key; });
}

void Outbox::withdraw(MessageKey key) {
  if (const auto entry = find(key); entry != keyed_.end()) erase(entry);
}

void Outbox::clear() {
  queue_.clear();
  queued_bytes_ = 0;
  keyed_.clear();
  keyed_bytes_ = 0;
}

const Message* Outbox::beginTransmission() {
  if (in_transmission_) return nullptr;
  if (!queue_.empty()) {
    queued_bytes_ -= queue_.front().size();
    in_transmission_ = std::move(queue_.front());
    queue_.pop_front();
  } else if (!keyed_.empty()) {
    keyed_bytes_ -= keyed_.front().second.size();
    in_transmission_ = std::move(keyed_.front().second);
    keyed_.pop_front();
  }
  return in_transmission_ ? &*in_transmission_ : nullptr;
}

}  // namespace hapticd::tools::view
