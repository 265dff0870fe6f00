// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

/// Another vendor's DDS, Fast DDS, which is the usual one below ROS 2: with a type of plain bytes and without
/// descriptions of types, as the RMW of ROS 2 uses it.
namespace hapticd::test {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// Samples are the bytes of messages, with those of the encoding in front.
class PlainBytes final : public dds::TopicDataType {
 public:
  explicit PlainBytes(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 65536;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string*>(data);
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data), payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

struct WriterOfFast {
  std::string type;
  std::string user_data;
  bool describes_its_type = false;
};

/// What Fast DDS discovers.
class Discoveries final : public dds::DomainParticipantListener {
 public:
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& found) override {
    const std::lock_guard lock(mutex_);
    const auto& user_data = found.info.m_qos.m_userData.getValue();
    writers_[found.info.topicName().to_string()] = {found.info.typeName().to_string(),
                                                    {user_data.begin(), user_data.end()},
                                                    found.info.has_type_information()};
  }
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& found) override {
    const std::lock_guard lock(mutex_);
    const auto& user_data = found.info.m_userData;
    participants_.emplace_back(user_data.begin(), user_data.end());
  }
  std::optional<WriterOfFast> writerOf(const std::string& topic) {
    const std::lock_guard lock(mutex_);
    const auto found = writers_.find(topic);
    return found == writers_.end() ? std::nullopt : std::optional(found->second);
  }
  std::vector<std::string> participants() {
    const std::lock_guard lock(mutex_);
    return participants_;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, WriterOfFast> writers_;
  std::vector<std::string> participants_;
};

/// A program of Fast DDS at one interface.
class FastPeer {
 public:
  explicit FastPeer(int domain, const std::string& address = "127.0.0.1") {
    dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
    const auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.emplace_back(address);
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(domain), qos, &discoveries_, dds::StatusMask::none());
    EXPECT_NE(participant_, nullptr);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  }
  ~FastPeer() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  FastPeer(const FastPeer&) = delete;
  FastPeer& operator=(const FastPeer&) = delete;

  Discoveries& discoveries() { return discoveries_; }

  /// As a subscriber of ROS 2 has it; late: transient local.
  dds::DataReader* subscribe(const std::string& topic, const std::string& type, bool late) {
    return subscribe(topic, type, Asked{.late = late});
  }
  /// What a subscriber asks for; the default is that of rclcpp.
  struct Asked {
    bool reliable = true;
    bool late = false;
    int depth = 10;
  };
  dds::DataReader* subscribe(const std::string& topic, const std::string& type, const Asked& asked) {
    participant_->register_type(dds::TypeSupport(new PlainBytes(type)));
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind =
        asked.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = asked.late ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = asked.depth;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    dds::TopicDescription* description = participant_->lookup_topicdescription(topic);
    if (description == nullptr) description = participant_->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT);
    dds::DataReader* const reader = subscriber_->create_datareader(description, qos);
    EXPECT_NE(reader, nullptr) << topic;
    return reader;
  }

  static bool isMatched(dds::DataReader* reader) {
    dds::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
    return status.current_count > 0;
  }

  /// As a publisher of ROS 2 has it.
  dds::DataWriter* advertise(const std::string& topic, const std::string& type) {
    participant_->register_type(dds::TypeSupport(new PlainBytes(type)));
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    dds::DataWriter* const writer =
        publisher_->create_datawriter(participant_->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT), qos);
    EXPECT_NE(writer, nullptr) << topic;
    return writer;
  }
  static void publish(dds::DataWriter* writer, std::string bytes) { EXPECT_TRUE(writer->write(&bytes)); }

  /// The messages that have come since the last call.
  static std::vector<std::string> take(dds::DataReader* reader) {
    std::vector<std::string> messages;
    std::string bytes;
    dds::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) messages.push_back(bytes);
    }
    return messages;
  }

 private:
  Discoveries discoveries_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
};

}  // namespace hapticd::test
