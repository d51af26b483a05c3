#pragma once
// Posts events to one URL by libcurl, on a thread of its own.

#include <memory>
#include <stop_token>
#include <thread>

#include "daemon/service/notify/notify_settings.hpp"
#include "daemon/service/notify/outbox.hpp"

namespace weft::daemon::notify {

class Webhook {
 public:
  /// The thread begins at once.
  explicit Webhook(WebhookSettings settings);
  /// Tries for 2 s, a request under way up to 3 s, to send what waits; the rest is lost.
  ~Webhook();
  Webhook(const Webhook&) = delete;
  Webhook& operator=(const Webhook&) = delete;

  Outbox& outbox() { return outbox_; }

 private:
  void run(const std::stop_token& stop);

  const WebhookSettings settings_;
  Outbox outbox_;
  std::jthread thread_;  // last: it uses all the others
};

}  // namespace weft::daemon::notify
