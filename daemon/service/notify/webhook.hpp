#pragma once
// Posts events to one URL with libcurl, on its own thread.

#include <memory>
#include <stop_token>
#include <thread>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class Webhook {
 public:
  /// Starts the thread immediately.
  explicit Webhook(WebhookSettings settings);
  /// Tries for 2 s to send waiting events; an active request may take up to 3 s. The rest is lost.
  ~Webhook();
  Webhook(const Webhook&) = delete;
  Webhook& operator=(const Webhook&) = delete;

  Outbox& outbox() { return outbox_; }

 private:
  void run(const std::stop_token& stop);

  const WebhookSettings settings_;
  Outbox outbox_;
  std::jthread thread_;  // last: it uses all other members
};

}  // namespace weft::daemon::notify
