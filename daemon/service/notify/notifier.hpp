#pragma once
// Calls people: turns what the daemon's parts report into events and hands them to senders with
// threads of their own. Nothing here waits. Source: docs/howto/notify.md.

#include <filesystem>
#include <functional>
#include <memory>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class Webhook;
class MqttPublisher;

/// What the notifier uses of the daemon.
struct NotifierContext {
  std::string bench;              ///< name of the rig
  std::string client;             ///< name at an MQTT broker
  std::filesystem::path data;     ///< folder of runs, whose disk is watched
  runs::RunStore* log = nullptr;  ///< gets lines of kind "notify.failed"
  std::function<std::int64_t()> utc_us;
  std::function<Clock()> now;
};

/// Used by the server's thread.
class Notifier {
 public:
  /// `file`: of the settings; empty: nobody is called. Errors: load_notify_settings()'s.
  static Result<std::unique_ptr<Notifier>> open(NotifierContext context,
                                                const std::filesystem::path& file);
  /// `settings`: none where nobody is to be called; ends are counted all the same.
  Notifier(NotifierContext context, const std::optional<NotifySettings>& settings);
  ~Notifier();  ///< as close()
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void on_run(const runs::RunView& run);
  /// An end that the daemon before this one did not live to tell.
  void on_cut_by_restart(const runs::RunView& run);
  void on_queue(const runs::RunQueue& queue);
  /// `text`: what the rig does or is, as `rig.state` has it.
  void on_rig(const runs::RigState& rig, std::string_view text);
  /// Call often: the disk is looked at every 10 s, the state sent once a second at most.
  void tick();
  /// Ends the senders: what waits is tried for a few seconds more.
  void close();

  /// By sender, "webhook" and "mqtt"; those that there are.
  [[nodiscard]] std::vector<std::pair<std::string, DeliveryCounts>> counts() const;
  /// As EventDetector has it.
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
