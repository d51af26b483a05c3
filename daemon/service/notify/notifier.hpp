#pragma once
// Notifies people: turns reports of the daemon's parts into events for senders with their own
// threads. Nothing here blocks. Source: docs/howto/notify.md.

#include <filesystem>
#include <functional>
#include <memory>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class Webhook;
class MqttPublisher;

/// Parts of the daemon that the notifier uses.
struct NotifierContext {
  std::string bench;              ///< name of the rig
  std::string client;             ///< client name at an MQTT broker
  std::filesystem::path data;     ///< folder of runs; the free space of its disk is checked
  runs::RunStore* log = nullptr;  ///< receives lines of kind "notify.failed"
  std::function<std::int64_t()> utc_us;
  std::function<Clock()> now;
};

/// Thread: the server's.
class Notifier {
 public:
  /// `file`: the settings; empty: no notifications. Errors: those of load_notify_settings().
  static Result<std::unique_ptr<Notifier>> open(NotifierContext context,
                                                const std::filesystem::path& file);
  /// `settings`: none for no notifications; ends of runs are counted all the same.
  Notifier(NotifierContext context, const std::optional<NotifySettings>& settings);
  ~Notifier();  ///< as close()
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void on_run(const runs::RunView& run);
  /// Reports the end of a run that was active when the previous daemon died.
  void on_cut_by_restart(const runs::RunView& run);
  void on_queue(const runs::RunQueue& queue);
  /// `text`: the rig's state, as in `rig.state`.
  void on_rig(const runs::RigState& rig, std::string_view text);
  /// Call often: checks the disk every 10 s, sends the state at most once a second.
  void tick();
  /// Ends the senders, which try for a few more seconds to send waiting events.
  void close();

  /// By sender: "webhook" and "mqtt", if configured.
  [[nodiscard]] std::vector<std::pair<std::string, DeliveryCounts>> counts() const;
  /// See EventDetector::ended().
  [[nodiscard]] const std::map<std::string, std::uint64_t>& runs_ended() const {
    return detector_.ended();
  }

 private:
  struct Sender {
    std::string name;
    Outbox* outbox;
  };
  void send(const Event& event);
  void report_failures();
  void check_disk(Clock now);
  void publish_state(Clock now);

  NotifierContext context_;
  std::vector<EventKind> wanted_;
  EventDetector detector_;
  std::unique_ptr<nlohmann::json> state_;  ///< for MQTT
  bool state_is_new_ = true;
  std::optional<Clock> disk_checked_, state_sent_;
  std::unique_ptr<Webhook> webhook_;
  std::unique_ptr<MqttPublisher> mqtt_;
  std::vector<Sender> senders_;
};

}  // namespace weft::daemon::notify
