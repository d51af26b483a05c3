#include "daemon/service/notify/mqtt_publisher.hpp"

#include <mosquitto.h>
#include <poll.h>

#include <cerrno>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon::notify {
namespace {

using namespace std::chrono_literals;

constexpr int keep_alive_s = 15;  // the broker sends the last will after 1.5 times that
constexpr int poll_ms = 50;       // the longest delay before an event is sent
constexpr Clock longest_connect = 10s;
constexpr Clock longest_farewell = 2s;

std::string mqtt_error_text(int code) {
  return code == MOSQ_ERR_ERRNO ? std::generic_category().message(errno)
                                : std::string(mosquitto_strerror(code));
}

}  // namespace

/// One connection, from the attempt to its loss. Thread: one, which calls poll() until there is an
/// error.
class MqttPublisher::Connection {
 public:
  /// `only_ipv4`: without blocking, libmosquitto tries one address of a name only, which may be an
  /// IPv6 address without a listener.
  Connection(MqttPublisher& owner, bool only_ipv4);

  /// Sends and receives for at most `poll_ms`; publishes new messages.
  void poll(const std::stop_token& stop);
  /// Why the connection ended.
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }
  /// True if the broker has acknowledged everything.
  [[nodiscard]] bool is_idle() const;
  /// Closes in order, so that the broker sends no last will.
  void close();

 private:
  static Connection& self(void* object) { return *static_cast<Connection*>(object); }
  void check(int code) {
    if (code != MOSQ_ERR_SUCCESS && !error_) error_ = mqtt_error_text(code);
  }
  void check_socket();
  void on_connect(int code);
  void on_published(int message);
  void set_tls(const MqttSettings& settings);
  /// Returns the message number, which on_published() receives.
  int publish(const char* name, const std::string& payload, bool retain);
  void publish_news(const std::stop_token& stop);

  MqttPublisher& owner_;
  std::unique_ptr<mosquitto, decltype(&mosquitto_destroy)> handle_;
  const Clock began_ = steady_wall_now();
  bool is_connected_ = false;
  int farewell_ = 0;  ///< number of the "offline" message, once sent
  bool is_gone_ = false;
  std::uint64_t state_sent_ = 0;
  int state_message_ = 0;
  std::optional<std::pair<int, std::uint64_t>> event_;  ///< message and number in the outbox
  std::optional<std::string> error_;
};

MqttPublisher::Connection::Connection(MqttPublisher& owner, bool only_ipv4)
    : owner_(owner), handle_(mosquitto_new(owner.client_.c_str(), true, this), &mosquitto_destroy) {
  if (!handle_) {
    error_ = "no memory for the MQTT client";
    return;
  }
  const MqttSettings& settings = owner.settings_;
  mosquitto* const handle = handle_.get();
  mosquitto_connect_callback_set(
      handle, [](mosquitto*, void* object, int code) { self(object).on_connect(code); });
  mosquitto_publish_callback_set(
      handle, [](mosquitto*, void* object, int message) { self(object).on_published(message); });
  mosquitto_disconnect_callback_set(
      handle, [](mosquitto*, void* object, int) { self(object).is_gone_ = true; });
  const std::string topic = settings.topic + "/availability", offline = "offline";
  check(mosquitto_will_set(handle, topic.c_str(), static_cast<int>(offline.size()), offline.data(),
                           1, true));
  if (!settings.user.empty())
    check(mosquitto_username_pw_set(handle, settings.user.c_str(), settings.password.c_str()));
  if (settings.tls != TlsUse::off) set_tls(settings);
  // Not the blocking call: an unresponsive host would delay the daemon's end.
  check(mosquitto_connect_bind_async(handle, settings.host.c_str(), settings.port, keep_alive_s,
                                     only_ipv4 ? "0.0.0.0" : nullptr));
}

void MqttPublisher::Connection::set_tls(const MqttSettings& settings) {
  mosquitto* const handle = handle_.get();
  if (settings.ca_file.empty())
    check(mosquitto_int_option(handle, MOSQ_OPT_TLS_USE_OS_CERTS, 1));
  else
    check(mosquitto_tls_set(handle, settings.ca_file.c_str(), nullptr, nullptr, nullptr, nullptr));
  const bool verified = settings.tls == TlsUse::verified;
  check(mosquitto_tls_opts_set(handle, verified ? 1 : 0, nullptr, nullptr));
  check(mosquitto_tls_insecure_set(handle, !verified));
}

// libmosquitto does not report a refused connection when it connects under TLS without blocking.
void MqttPublisher::Connection::check_socket() {
  pollfd entry{.fd = mosquitto_socket(handle_.get()), .events = POLLOUT, .revents = 0};
  if (entry.fd >= 0 && ::poll(&entry, 1, 0) == 1 && (entry.revents & (POLLERR | POLLHUP)) != 0)
    error_ = "connection refused";
}

void MqttPublisher::Connection::on_connect(int code) {
  if (code != 0) {
    error_ = mosquitto_connack_string(code);
    return;
  }
  is_connected_ = true;
  publish("/availability", "online", true);
}

// Only an acknowledged message proves success: a broker may accept a login and then close the
// connection when a message is published.
void MqttPublisher::Connection::on_published(int message) {
  owner_.outbox_.on_reached();
  if (event_ && event_->first == message) {
    owner_.outbox_.on_sent(event_->second);
    event_.reset();
  }
  if (state_message_ == message) state_message_ = 0;
  if (farewell_ == message) mosquitto_disconnect(handle_.get());
}

int MqttPublisher::Connection::publish(const char* name, const std::string& payload, bool retain) {
  int message = 0;
  const std::string topic = owner_.settings_.topic + name;
  check(mosquitto_publish(handle_.get(), &message, topic.c_str(), static_cast<int>(payload.size()),
                          payload.data(), 1, retain));
  return message;
}

void MqttPublisher::Connection::publish_news(const std::stop_token& stop) {
  const State newest = owner_.state();
  if (newest.revision > state_sent_) {
    state_sent_ = newest.revision;
    state_message_ = publish("/state", newest.json, true);
  }
  if (event_) return;  // one at a time, to keep the order
  const auto entry = owner_.outbox_.front(stop, 0ms);
  if (!entry) return;
  const int message = publish("/event", format_event_json(to_json(entry->event)), false);
  event_.emplace(message, entry->number);
}

void MqttPublisher::Connection::poll(const std::stop_token& stop) {
  if (error_) return;
  if (is_connected_ && farewell_ == 0) publish_news(stop);
  if (!is_connected_) check_socket();
  if (!error_) check(mosquitto_loop(handle_.get(), poll_ms, 1));
  if (!is_connected_ && !error_ && steady_wall_now() - began_ > longest_connect)
    error_ = "connection timed out";
  if (is_gone_ && !error_) error_ = "connection closed";
}

bool MqttPublisher::Connection::is_idle() const {
  return is_connected_ && !event_ && state_message_ == 0 && owner_.outbox_.counts().waiting == 0 &&
         owner_.state().revision == state_sent_;
}

void MqttPublisher::Connection::close() {
  if (error_ || !is_connected_) return;
  farewell_ = publish("/availability", "offline", true);
  const Clock until = steady_wall_now() + longest_farewell;
  while (!is_gone_ && !error_ && steady_wall_now() < until)
    check(mosquitto_loop(handle_.get(), poll_ms, 1));
}

MqttPublisher::MqttPublisher(MqttSettings settings, std::string client)
    : settings_(std::move(settings)),
      client_(std::move(client)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

MqttPublisher::~MqttPublisher() = default;

void MqttPublisher::set_state(std::string state_json) {
  const std::lock_guard lock(mutex_);
  if (state_.json == state_json) return;
  state_ = {std::move(state_json), state_.revision + 1};
}

MqttPublisher::State MqttPublisher::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void MqttPublisher::run(const std::stop_token& stop) {
  static const int once = mosquitto_lib_init();
  static_cast<void>(once);
  std::optional<Clock> until;
  for (bool only_ipv4 = false; !stop.stop_requested(); only_ipv4 = !only_ipv4) {
    Connection connection(*this, only_ipv4);
    while (!connection.error()) {
      connection.poll(stop);
      if (!stop.stop_requested()) continue;
      if (!until) until = steady_wall_now() + longest_farewell;
      if (connection.is_idle() || steady_wall_now() > *until) return connection.close();
    }
    outbox_.wait(stop, outbox_.on_failed(*connection.error(), steady_wall_now()));
  }
}

}  // namespace weft::daemon::notify
