// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/cdr_topic.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <utility>

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kHeadBytes = 4;  // of the encoding

/// What Cyclone DDS holds of a message.
struct Sample : ddsi_serdata {
  /// Filled up to whole words, as RTPS has it.
  std::string bytes;
  /// The length of the message, where it was received.
  std::size_t length = 0;

  Sample(const ddsi_sertype* sample_type, ddsi_serdata_kind sample_kind) : ddsi_serdata() {
    ddsi_serdata_init(this, sample_type, sample_kind);
    hash = sample_type->serdata_basehash;  // one instance: there is no key
  }
  void fillUp() { bytes.append((kHeadBytes - bytes.size() % kHeadBytes) % kHeadBytes, '\0'); }
};

const Sample& sampleOf(const ddsi_serdata* data) {
  return *static_cast<const Sample*>(data);
}

/// Takes over what has come; null: it is not in CDR. The last two bits of the encoding say by how many bytes
/// a message was filled up.
ddsi_serdata* received(std::unique_ptr<Sample> sample) {
  std::string& bytes = sample->bytes;
  if (bytes.size() < kHeadBytes || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1)) return nullptr;
  const auto filled = static_cast<std::size_t>(bytes[3] & 3);
  sample->length = bytes.size() - (bytes.size() < kHeadBytes + filled ? 0 : filled);
  bytes[2] = bytes[3] = 0;
  sample->fillUp();
  return sample.release();
}

ddsi_serdata* fromNetwork(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                          std::size_t size) {
  auto sample = std::make_unique<Sample>(type, kind);
  sample->bytes.reserve(size);
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    const std::size_t have = sample->bytes.size();
    if (fragment->maxp1 <= have) continue;  // fragments may overlap
    const auto* const payload =
        reinterpret_cast<const char*>(NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)));
    sample->bytes.append(payload + (have - fragment->min), fragment->maxp1 - have);
  }
  return received(std::move(sample));
}

ddsi_serdata* fromParts(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                        const ddsrt_iovec_t* parts, std::size_t size) {
  auto sample = std::make_unique<Sample>(type, kind);
  for (ddsrt_msg_iovlen_t i = 0; i < count; ++i)
    sample->bytes.append(static_cast<const char*>(parts[i].iov_base), parts[i].iov_len);
  sample->bytes.resize(size);
  return received(std::move(sample));
}

ddsi_serdata* withoutType(const ddsi_serdata* data) {
  auto* const sample = new Sample(data->type, SDK_KEY);
  sample->type = nullptr;
  return sample;
}

ddsi_serdata_ops serdataFunctions() {
  ddsi_serdata_ops all{};
  all.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  all.get_size = [](const ddsi_serdata* data) {
    return static_cast<std::uint32_t>(sampleOf(data).bytes.size());
  };
  all.from_ser = fromNetwork;
  all.from_ser_iov = fromParts;
  all.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
    return new Sample(type, SDK_KEY);
  };
  // samples of the application are not used: dds_writecdr() and dds_takecdr() pass these ones
  all.from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind kind, const void*) -> ddsi_serdata* {
    return kind == SDK_KEY ? new Sample(type, kind) : nullptr;
  };
  all.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  all.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return true; };
  all.to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
    std::memcpy(to, sampleOf(data).bytes.data() + offset, size);
  };
  all.to_ser_ref = [](const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* part) {
    part->iov_base = const_cast<char*>(sampleOf(data).bytes.data() + offset);
    part->iov_len = size;
    return ddsi_serdata_ref(data);
  };
  all.to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); };
  all.to_untyped = withoutType;
  all.free = [](ddsi_serdata* data) { delete static_cast<Sample*>(data); };
  all.print = [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t size) {
    if (size > 0) text[0] = '\0';
    return std::size_t{0};
  };
  all.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash, bool) { *hash = {}; };
  return all;
}
const ddsi_serdata_ops kSerdata = serdataFunctions();

ddsi_sertype_ops sertypeFunctions() {
  ddsi_sertype_ops all{};
  all.version = ddsi_sertype_v0;
  all.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete type;
  };
  all.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  all.realloc_samples = [](void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) samples[i] = nullptr;
  };
  all.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  all.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // of the same name
  all.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return all;
}
const ddsi_sertype_ops kSertype = sertypeFunctions();

}  // namespace

CdrTopic createCdrTopic(dds_entity_t participant, const std::string& name, const std::string& type) {
  auto* sertype = new ddsi_sertype{};
  ddsi_sertype_init_flags(sertype, type.c_str(), &kSertype, &kSerdata, DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  sertype->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  const dds_entity_t entity =
      dds_create_topic_sertype(participant, name.c_str(), &sertype, nullptr, nullptr, nullptr);
  if (entity < 0) ddsi_sertype_unref(sertype);
  return {entity, entity < 0 ? nullptr : sertype};
}

dds_return_t writeCdr(dds_entity_t writer, const ddsi_sertype& type, std::string message) {
  auto sample = std::make_unique<Sample>(&type, SDK_DATA);
  sample->bytes = std::move(message);
  sample->length = sample->bytes.size();
  sample->fillUp();
  sample->bytes[3] = static_cast<char>(sample->bytes.size() - sample->length);
  return dds_writecdr(writer, sample.release());
}

void takeCdr(dds_entity_t reader,
             const std::function<void(std::string_view message, const dds_sample_info_t& info)>& take) {
  constexpr std::size_t kAtOnce = 16;
  std::array<ddsi_serdata*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> infos{};
  for (;;) {
    const dds_return_t count = dds_takecdr(reader, samples.data(), kAtOnce, infos.data(), DDS_ANY_STATE);
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const Sample& sample = sampleOf(samples[i]);
      if (infos[i].valid_data) take(std::string_view(sample.bytes).substr(0, sample.length), infos[i]);
      ddsi_serdata_unref(samples[i]);
    }
  }
}

}  // namespace hapticd::tools::ros
