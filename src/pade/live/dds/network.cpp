#include "pade/live/dds/network.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "pade/live/dds/cdr_type.hpp"

namespace pade::live {
namespace {

/// An entity of CycloneDDS, deleted at the end with all that is below it.
class Entity {
 public:
  explicit Entity(dds_entity_t number = 0) : number_(number) {}
  Entity(Entity&& other) noexcept : number_(std::exchange(other.number_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Entity() {
    if (number_ > 0) (void)dds_delete(number_);
  }
  [[nodiscard]] dds_entity_t number() const { return number_; }
  [[nodiscard]] bool good() const { return number_ > 0; }

 private:
  dds_entity_t number_;
};

struct FreeQuality {
  void operator()(dds_qos_t* quality) const { dds_delete_qos(quality); }
};
using Quality = std::unique_ptr<dds_qos_t, FreeQuality>;

/// What a participant reads of its own accord: which policy two sides do not agree on.
std::string_view policy_name(std::uint32_t policy) {
  switch (policy) {
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "DURABILITY";
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "RELIABILITY";
    case DDS_DEADLINE_QOS_POLICY_ID:
      return "DEADLINE";
    case DDS_LIVELINESS_QOS_POLICY_ID:
      return "LIVELINESS";
    case DDS_OWNERSHIP_QOS_POLICY_ID:
      return "OWNERSHIP";
    case DDS_LATENCYBUDGET_QOS_POLICY_ID:
      return "LATENCY BUDGET";
    default:
      return "QoS";
  }
}

Error entity_failed(const std::string& what, dds_entity_t code) {
  return Error{fmt::format("{}: {}, expected a network that DDS can use", what, dds_strretcode(code))};
}

class CycloneReader : public TopicReader {
 public:
  CycloneReader(dds_entity_t participant, int domain, std::string topic, std::string type)
      : participant_(participant), domain_(domain), topic_(std::move(topic)), type_(std::move(type)) {}

  Status open(int kept) {
    const std::string name = fmt::format("rt{}", topic_);
    ddsi_sertype* type = cdr_type::create(dds_type_name(type_));
    entity_ = Entity(dds_create_topic_sertype(participant_, name.c_str(), &type, nullptr, nullptr, nullptr));
    if (!entity_.good()) return entity_failed(topic_, entity_.number());
    const Quality quality(dds_create_qos());
    dds_qset_reliability(quality.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
    dds_qset_durability(quality.get(), DDS_DURABILITY_VOLATILE);
    dds_qset_history(quality.get(), DDS_HISTORY_KEEP_LAST, kept);
    reader_ = Entity(dds_create_reader(participant_, entity_.number(), quality.get(), nullptr));
    if (!reader_.good()) return entity_failed(topic_, reader_.number());
    condition_ = Entity(dds_create_readcondition(reader_.number(), DDS_ANY_STATE));
    waitset_ = Entity(dds_create_waitset(participant_));
    if (!condition_.good() || !waitset_.good() ||
        dds_waitset_attach(waitset_.number(), condition_.number(), 0) != DDS_RETCODE_OK)
      return entity_failed(topic_, condition_.number());
    publications_ =
        Entity(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr));
    return {};
  }

  bool take(std::string& message) override {
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info{};
    while (dds_takecdr(reader_.number(), &sample, 1, &info, DDS_ANY_STATE) == 1) {
      const bool good = info.valid_data;  // else a publisher has gone
      if (good) message = cdr_type::bytes_of(sample);
      ddsi_serdata_unref(sample);
      if (!good) continue;
      ++count_;
      return true;
    }
    return false;
  }

  void wait(int milliseconds) override {
    dds_attach_t hit = 0;
    (void)dds_waitset_wait(waitset_.number(), &hit, 1, DDS_MSECS(milliseconds));
  }

  std::string remark() override {
    const TopicReport now = report();
    if (now.peers > 0) return {};
    if (!now.mismatch.empty()) return now.mismatch;
    for (const std::string& type : types_published()) {
      if (type != dds_type_name(type_))
        return fmt::format("{} is published as {}, expected {}", topic_, ros_type_name(type), type_);
    }
    return fmt::format("nobody publishes {} in domain {}", topic_, domain_);
  }

  TopicReport report() override {
    TopicReport report;
    dds_subscription_matched_status_t matched{};
    if (dds_get_subscription_matched_status(reader_.number(), &matched) == DDS_RETCODE_OK)
      report.peers = matched.current_count;
    dds_requested_incompatible_qos_status_t incompatible{};
    if (dds_get_requested_incompatible_qos_status(reader_.number(), &incompatible) == DDS_RETCODE_OK &&
        incompatible.total_count > 0)
      report.mismatch =
          fmt::format("{}: a publisher has another {}", topic_, policy_name(incompatible.last_policy_id));
    report.count = count_;
    return report;
  }

 private:
  /// Of this topic, by anybody.
  [[nodiscard]] std::set<std::string> types_published() const {
    constexpr std::size_t kMost = 256;
    std::set<std::string> types;
    std::array<void*, kMost> samples{};
    std::array<dds_sample_info_t, kMost> infos{};
    const int count = dds_read(publications_.number(), samples.data(), infos.data(), kMost, kMost);
    if (count <= 0) return types;
    const std::string name = fmt::format("rt{}", topic_);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto* const endpoint = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      const bool alive = infos[i].valid_data && infos[i].instance_state == DDS_IST_ALIVE;
      if (alive && name == endpoint->topic_name) types.insert(endpoint->type_name);
    }
    (void)dds_return_loan(publications_.number(), samples.data(), count);
    return types;
  }

  dds_entity_t participant_;
  int domain_;
  std::string topic_, type_;
  std::size_t count_ = 0;
  Entity entity_, reader_, condition_, waitset_, publications_;
};

class CycloneWriter : public TopicWriter {
 public:
  CycloneWriter(dds_entity_t participant, std::string topic)
      : participant_(participant), topic_(std::move(topic)) {}

  Status open(std::string_view type_name, TopicQuality kind) {
    const std::string name = fmt::format("rt{}", topic_);
    ddsi_sertype* type = cdr_type::create(dds_type_name(type_name));
    entity_ = Entity(dds_create_topic_sertype(participant_, name.c_str(), &type, nullptr, nullptr, nullptr));
    if (!entity_.good()) return entity_failed(topic_, entity_.number());
    const Quality quality(dds_create_qos());
    const bool best_effort = kind == TopicQuality::sensor;
    dds_qset_reliability(quality.get(), best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                         DDS_MSECS(100));
    const int kept = kind == TopicQuality::latched ? 1 : best_effort ? 5 : 100;
    dds_qset_history(quality.get(), DDS_HISTORY_KEEP_LAST, kept);
    if (kind == TopicQuality::latched) {
      dds_qset_durability(quality.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      dds_qset_durability_service(quality.get(), 0, DDS_HISTORY_KEEP_LAST, kept, DDS_LENGTH_UNLIMITED,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
    } else {
      dds_qset_durability(quality.get(), DDS_DURABILITY_VOLATILE);
    }
    writer_ = Entity(dds_create_writer(participant_, entity_.number(), quality.get(), nullptr));
    if (!writer_.good()) return entity_failed(topic_, writer_.number());
    return {};
  }

  bool write(std::string_view message) override {
    const cdr_type::Sample sample{message};
    if (dds_write(writer_.number(), &sample) != DDS_RETCODE_OK) {
      ++failed_;
      return false;
    }
    ++count_;
    return true;
  }

  std::size_t subscribers() override {
    dds_publication_matched_status_t matched{};
    if (dds_get_publication_matched_status(writer_.number(), &matched) != DDS_RETCODE_OK) return 0;
    return matched.current_count;
  }

  TopicReport report() override {
    TopicReport report;
    report.peers = subscribers();
    report.count = count_;
    report.failed = failed_;
    dds_offered_incompatible_qos_status_t incompatible{};
    if (dds_get_offered_incompatible_qos_status(writer_.number(), &incompatible) == DDS_RETCODE_OK &&
        incompatible.total_count > 0)
      report.mismatch = fmt::format("{}: a subscriber asks for another {}", topic_,
                                    policy_name(incompatible.last_policy_id));
    return report;
  }

 private:
  dds_entity_t participant_;
  std::string topic_;
  std::size_t count_ = 0, failed_ = 0;
  Entity entity_, writer_;
};

class CycloneNetwork : public DdsNetwork {
 public:
  Status join(int domain, bool local) {
    domain_ = domain;
    // The user's own settings (CYCLONEDDS_URI) hold beside ours. Loopback has no multicast: all are asked.
    constexpr const char* kLocal =
        "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</"
        "MaxAutoParticipantIndex>"
        "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";
    if (local) {
      const char* const theirs = std::getenv("CYCLONEDDS_URI");
      const std::string settings = theirs == nullptr ? kLocal : fmt::format("{},{}", kLocal, theirs);
      const dds_entity_t made = dds_create_domain(static_cast<dds_domainid_t>(domain), settings.c_str());
      // One that this process has joined already stays as it is.
      if (made < 0 && made != DDS_RETCODE_PRECONDITION_NOT_MET) return entity_failed("dds", made);
      if (made > 0) own_domain_ = Entity(made);
    }
    participant_ = Entity(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr));
    if (participant_.good()) return {};
    return entity_failed(fmt::format("dds: domain {}", domain), participant_.number());
  }

  [[nodiscard]] int domain() const override { return domain_; }

  Result<std::unique_ptr<TopicWriter>> writer(const std::string& topic, std::string_view type,
                                              TopicQuality quality) override {
    auto made = std::make_unique<CycloneWriter>(participant_.number(), topic);
    if (const Status status = made->open(type, quality); !status) return status.error();
    return std::unique_ptr<TopicWriter>(std::move(made));
  }
  Result<std::unique_ptr<TopicReader>> reader(const std::string& topic, std::string_view type,
                                              int kept) override {
    auto made = std::make_unique<CycloneReader>(participant_.number(), domain_, topic, std::string(type));
    if (const Status status = made->open(kept); !status) return status.error();
    return std::unique_ptr<TopicReader>(std::move(made));
  }

 private:
  int domain_ = 0;
  Entity own_domain_, participant_;
};

}  // namespace

Result<std::unique_ptr<DdsNetwork>> DdsNetwork::open(const DdsOptions& options) {
  const auto domain = domain_of(options);
  if (!domain) return domain.error();
  auto network = std::make_unique<CycloneNetwork>();
  if (const Status status = network->join(*domain, is_local(options)); !status) return status.error();
  return std::unique_ptr<DdsNetwork>(std::move(network));
}

}  // namespace pade::live
