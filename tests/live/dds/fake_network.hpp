// A network in memory: what is given to a topic, and what was written to one.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "pade/live/dds/network.hpp"

namespace pade::live {

/// All topics, for the test and for the parts that it tests. Any thread.
struct FakeTopics {
  std::mutex mutex;
  std::condition_variable come;
  std::map<std::string, std::deque<std::string>> to_read;
  std::map<std::string, std::vector<std::string>> written;
  std::map<std::string, std::string> types;
  std::map<std::string, TopicQuality> qualities;
  std::map<std::string, std::size_t> subscribers;
  std::string remark = "nobody publishes it";
  std::function<void()> on_write;  // before each message is kept

  void give(const std::string& topic, std::string message) {
    const std::lock_guard lock(mutex);
    to_read[topic].push_back(std::move(message));
    come.notify_all();
  }
  void subscribe(const std::string& topic, std::size_t count) {
    const std::lock_guard lock(mutex);
    subscribers[topic] = count;
  }
  std::vector<std::string> of(const std::string& topic) {
    const std::lock_guard lock(mutex);
    return written[topic];
  }
  /// False: it did not come to that, however long.
  bool await(const std::function<bool()>& ready) {
    std::unique_lock lock(mutex);
    return come.wait_for(lock, std::chrono::seconds(20), ready);
  }
  bool await_count(const std::string& topic, std::size_t count) {
    return await([&] { return written[topic].size() >= count; });
  }
};

class FakeReader : public TopicReader {
 public:
  FakeReader(FakeTopics& topics, std::string topic) : topics_(topics), topic_(std::move(topic)) {}
  bool take(std::string& message) override {
    const std::lock_guard lock(topics_.mutex);
    auto& waiting = topics_.to_read[topic_];
    if (waiting.empty()) return false;
    message = std::move(waiting.front());
    waiting.pop_front();
    return true;
  }
  void wait(int milliseconds) override {
    std::unique_lock lock(topics_.mutex);
    topics_.come.wait_for(lock, std::chrono::milliseconds(milliseconds),
                          [&] { return !topics_.to_read[topic_].empty(); });
  }
  std::string remark() override { return topics_.remark; }
  TopicReport report() override { return {}; }

 private:
  FakeTopics& topics_;
  std::string topic_;
};

class FakeWriter : public TopicWriter {
 public:
  FakeWriter(FakeTopics& topics, std::string topic) : topics_(topics), topic_(std::move(topic)) {}
  bool write(std::string_view message) override {
    if (topics_.on_write) topics_.on_write();
    const std::lock_guard lock(topics_.mutex);
    topics_.written[topic_].emplace_back(message);
    topics_.come.notify_all();
    return true;
  }
  std::size_t subscribers() override {
    const std::lock_guard lock(topics_.mutex);
    return topics_.subscribers[topic_];
  }
  TopicReport report() override {
    TopicReport report;
    report.peers = subscribers();
    if (topic_ == "/pade/cloud") report.mismatch = "/pade/cloud: a subscriber asks for another RELIABILITY";
    return report;
  }

 private:
  FakeTopics& topics_;
  std::string topic_;
};

class FakeNetwork : public DdsNetwork {
 public:
  [[nodiscard]] int domain() const override { return 7; }
  Result<std::unique_ptr<TopicWriter>> writer(const std::string& topic, std::string_view type,
                                              TopicQuality quality) override {
    topics.types[topic] = type;
    topics.qualities[topic] = quality;
    return std::unique_ptr<TopicWriter>(std::make_unique<FakeWriter>(topics, topic));
  }
  Result<std::unique_ptr<TopicReader>> reader(const std::string& topic, std::string_view type,
                                              int /*kept*/) override {
    topics.types[topic] = type;
    return std::unique_ptr<TopicReader>(std::make_unique<FakeReader>(topics, topic));
  }
  FakeTopics topics;
};

}  // namespace pade::live
