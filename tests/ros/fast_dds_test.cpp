// SPDX-License-Identifier: Apache-2.0
// hapticd-ros heard by another vendor's DDS, Fast DDS, which is the usual one below ROS 2: with a type of
// plain bytes and without descriptions of types, as the RMW of ROS 2 uses it.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/ros/ros_listener.h"
#include "tests/support/program.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

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
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }  // it only listens
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data), payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0U; };
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

/// A program of Fast DDS at the loopback interface.
class FastListener {
 public:
  explicit FastListener(int domain) {
    dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
    const auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(domain), qos, &discoveries_, dds::StatusMask::none());
    EXPECT_NE(participant_, nullptr);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  ~FastListener() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  FastListener(const FastListener&) = delete;
  FastListener& operator=(const FastListener&) = delete;

  Discoveries& discoveries() { return discoveries_; }

  /// As a subscriber of ROS 2 has it; late: transient local.
  dds::DataReader* subscribe(const std::string& topic, const std::string& type, bool late) {
    participant_->register_type(dds::TypeSupport(new PlainBytes(type)));
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = late ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    dds::DataReader* const reader =
        subscriber_->create_datareader(participant_->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT), qos);
    EXPECT_NE(reader, nullptr) << topic;
    return reader;
  }

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
};

TEST(FastDds, HearsTheBoxAndSeesTheUserDataOfRos2) {
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  const DaemonHome home;
  Daemon daemon(home, std::string(kWallYaml) + "control: {engage_at_start: true}\n");
  ASSERT_TRUE(daemon.answers());
  const Program bridge({HAPTICD_ROS_PROGRAM, "--socket", home.statusSocket(), "--domain",
                        std::to_string(domain), "--namespace", name_space});
  FastListener listener(domain);
  const std::string pose_topic = "rt/" + name_space + "/measured_cp";
  dds::DataReader* const poses =
      listener.subscribe(pose_topic, "geometry_msgs::msg::dds_::PoseStamped_", /*late=*/false);
  std::size_t count = 0;
  ASSERT_TRUE(becomesTrue([&] {
    for (const std::string& message : FastListener::take(poses)) {
      CdrBytes bytes(message);
      EXPECT_GT(bytes.number<std::int32_t>(), 1'700'000'000);
      EXPECT_LT(bytes.number<std::uint32_t>(), 1'000'000'000U);
      EXPECT_EQ(bytes.text(), name_space + "/world");
      for (int i = 0; i < 7; ++i) (void)bytes.number<double>();
      EXPECT_TRUE(bytes.ended());
      ++count;
    }
    return count >= 200;
  })) << bridge.errors();

  dds::DataReader* const states = listener.subscribe("rt/" + name_space + "/operating_state",
                                                     "crtk_msgs::msg::dds_::OperatingState_", /*late=*/true);
  std::vector<std::string> heard;
  ASSERT_TRUE(becomesTrue([&] { return !(heard = FastListener::take(states)).empty(); })) << bridge.errors();
  EXPECT_NE(heard.back().find("ENABLED"), std::string::npos);

  const auto writer = listener.discoveries().writerOf(pose_topic);
  ASSERT_TRUE(writer);
  EXPECT_EQ(writer->type, "geometry_msgs::msg::dds_::PoseStamped_");
  EXPECT_EQ(writer->user_data,
            "typehash=RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8;");
  EXPECT_FALSE(writer->describes_its_type);
  const std::vector<std::string> participants = listener.discoveries().participants();
  EXPECT_NE(std::ranges::find(participants, "enclave=/;"), participants.end());
}

}  // namespace
}  // namespace hapticd::test
