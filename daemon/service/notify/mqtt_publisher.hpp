#pragma once
// Publishes to one MQTT broker with libmosquitto, on its own thread. Topics: TOPIC/availability
// ("online", retained; the last will is "offline"), TOPIC/state (retained) and TOPIC/event. All
// with QoS 1: an event may arrive twice after a lost connection.

#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class MqttPublisher {
 public:
  /// Starts the thread immediately. `client`: client name; a broker allows each name once.
  MqttPublisher(MqttSettings settings, std::string client);
  /// Tries for at most 2 s to send waiting messages, then publishes "offline". A host name lookup
  /// is waited for, within the resolver's limits.
  ~MqttPublisher();
  MqttPublisher(const MqttPublisher&) = delete;
  MqttPublisher& operator=(const MqttPublisher&) = delete;

  Outbox& outbox() { return outbox_; }
  /// Sets the newest state; replaces one that was not yet sent. Thread: any.
  void set_state(std::string state_json);

 private:
  struct State {
    std::string json;
    std::uint64_t revision = 0;
  };
  class Connection;
  void run(const std::stop_token& stop);
  [[nodiscard]] State state() const;

  const MqttSettings settings_;
  const std::string client_;
  Outbox outbox_;
  mutable std::mutex mutex_;
  State state_;
  std::jthread thread_;  // last: it uses all other members
};

}  // namespace weft::daemon::notify
