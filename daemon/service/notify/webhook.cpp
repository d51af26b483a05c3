#include "daemon/service/notify/webhook.hpp"

#include <curl/curl.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon::notify {
namespace {

using namespace std::chrono_literals;

constexpr long connect_s = 5, request_s = 10;  // at most
constexpr Clock longest_drain = 2s;            // after the daemon's end

enum class Answer { taken, refused, failed };

/// One connection, kept open between requests. Thread: one.
class Poster {
 public:
  Poster(const WebhookSettings& settings, const std::stop_token& stop)
      : settings_(settings), stop_(stop), handle_(curl_easy_init(), &curl_easy_cleanup) {}

  /// On failure error() has the reason, without the URL, which may be a secret.
  Answer post(const Event& event);
  [[nodiscard]] const std::string& error() const { return error_; }
  /// True if the daemon has ended and the time for remaining events has passed.
  [[nodiscard]] bool is_over();

 private:
  using Headers = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;
  template <class Value>
  void set(CURLoption option, Value value) {
    curl_easy_setopt(handle_.get(), option, value);
  }
  [[nodiscard]] Headers headers_for(const nlohmann::json& event, bool is_text) const;
  void set_tls();
  static std::size_t ignore(char*, std::size_t size, std::size_t count, void*) {
    return size * count;
  }
  static int on_progress(void* self, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    return static_cast<Poster*>(self)->is_over() ? 1 : 0;
  }

  const WebhookSettings& settings_;
  const std::stop_token& stop_;
  std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle_;
  std::optional<Clock> stopped_at_;
  std::string error_;
};

bool Poster::is_over() {
  if (!stop_.stop_requested()) return false;
  if (!stopped_at_) stopped_at_ = steady_wall_now();
  return steady_wall_now() - *stopped_at_ > longest_drain;
}

Poster::Headers Poster::headers_for(const nlohmann::json& event, bool is_text) const {
  curl_slist* list = nullptr;
  const auto add = [&list](const std::string& line) {
    list = curl_slist_append(list, line.c_str());
  };
  // libcurl uses the first header of a name for its own: a configured Content-Type replaces ours.
  bool has_type = false;
  for (const auto& [name, text] : settings_.headers) {
    std::string value = expand(text, event);
    for (char& c : value)
      if (static_cast<unsigned char>(c) < ' ') c = ' ';  // an error may have line ends
    add(name + ": " + value);
    has_type = has_type || curl_strequal(name.c_str(), "Content-Type") != 0;
  }
  if (!has_type)
    add(is_text ? "Content-Type: text/plain; charset=utf-8" : "Content-Type: application/json");
  if (!settings_.token.empty()) add("Authorization: Bearer " + settings_.token);
  add("Expect:");  // no round trip before a short body
  return {list, &curl_slist_free_all};
}

void Poster::set_tls() {
  const bool verified = settings_.tls != TlsUse::unverified;
  set(CURLOPT_SSL_VERIFYPEER, verified ? 1L : 0L);
  set(CURLOPT_SSL_VERIFYHOST, verified ? 2L : 0L);
  if (settings_.ca_file.empty()) return;
  set(CURLOPT_CAINFO, settings_.ca_file.c_str());
  set<const char*>(CURLOPT_CAPATH, nullptr);  // no other CAs
}

Answer Poster::post(const Event& event) {
  const nlohmann::json fields = to_json(event);
  const std::string body = expand_body(settings_.body_json, fields);
  const Headers headers = headers_for(fields, settings_.body_json.starts_with('"'));
  char reason[CURL_ERROR_SIZE] = "";
  curl_easy_reset(handle_.get());
  set(CURLOPT_URL, settings_.url.c_str());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
  set(CURLOPT_POSTFIELDS, body.c_str());
  set(CURLOPT_HTTPHEADER, headers.get());
  set(CURLOPT_USERAGENT, "weftd");
  set(CURLOPT_CONNECTTIMEOUT, connect_s);
  set(CURLOPT_TIMEOUT, request_s);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_WRITEFUNCTION, &Poster::ignore);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &Poster::on_progress);
  set(CURLOPT_XFERINFODATA, this);
  set(CURLOPT_ERRORBUFFER, &reason[0]);
  set_tls();
  const CURLcode code = curl_easy_perform(handle_.get());
  set<char*>(CURLOPT_ERRORBUFFER, nullptr);
  if (code != CURLE_OK) {
    error_ = reason[0] != '\0' ? reason : curl_easy_strerror(code);
    return Answer::failed;
  }
  long status = 0;
  curl_easy_getinfo(handle_.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status >= 200 && status < 300) return Answer::taken;
  error_ = "server answered HTTP " + std::to_string(status);
  constexpr long timeout = 408, too_many = 429, server_error = 500;
  const bool is_passing = status >= server_error || status == timeout || status == too_many;
  return is_passing ? Answer::failed : Answer::refused;
}

}  // namespace

Webhook::Webhook(WebhookSettings settings)
    : settings_(std::move(settings)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Webhook::~Webhook() = default;

void Webhook::run(const std::stop_token& stop) {
  static const CURLcode once = curl_global_init(CURL_GLOBAL_DEFAULT);
  static_cast<void>(once);
  Poster poster(settings_, stop);
  while (!poster.is_over()) {
    const auto entry = outbox_.front(stop, 1h);
    if (!entry && stop.stop_requested()) return;
    if (!entry) continue;
    switch (poster.post(entry->event)) {
      case Answer::taken:
        outbox_.on_sent(entry->number);
        break;
      case Answer::refused:
        outbox_.on_refused(entry->number, poster.error());
        break;
      case Answer::failed:
        outbox_.wait(stop, outbox_.on_failed(poster.error(), steady_wall_now()));
        if (stop.stop_requested()) return;
    }
  }
}

}  // namespace weft::daemon::notify
