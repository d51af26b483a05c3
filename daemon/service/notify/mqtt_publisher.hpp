#pragma once
// Publishes to one MQTT broker by libmosquitto, on a thread of its own: TOPIC/availability
// ("online", retained; the last will is "offline"), TOPIC/state (retained) and TOPIC/event. All
// with QoS 1: an event may come twice after a lost connection.

#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class MqttPublisher {
 public:
  /// The thread begins at once. `client`: name at the broker, which allows each name once.
  MqttPublisher(MqttSettings settings, std::string client);
  /// Tries for at most 2 s to send what waits, then says "offline". A name that is being looked up
  /// is waited for, as the resolver's limits have it.
  ~MqttPublisher();
  MqttPublisher(const MqttPublisher&) = delete;
  MqttPublisher& operator=(const MqttPublisher&) = delete;

  Outbox& outbox() { return outbox_; }
  /// The newest state; one that was not sent yet is replaced. From any thread.
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
  std::jthread thread_;  // last: it uses all the others
};

}  // namespace weft::daemon::notify
