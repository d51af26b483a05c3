#pragma once
// Whom the daemon calls: the file of `weftd --notify`, read once, and templates of messages.
// Secrets are in files of their own that others may not read. Source: docs/howto/notify.md.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/service/notify/notify_event.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::notify {

enum class TlsUse : std::uint8_t {
  verified,    ///< the default
  unverified,  ///< encrypted, for whoever answers
  off
};

struct WebhookSettings {
  std::string url;    ///< http or https; may be a secret (url_file)
  std::string token;  ///< sent as a bearer; empty: none
  std::vector<std::pair<std::string, std::string>> headers;  ///< name, template
  std::string body_json;  ///< template, see expand_body(); empty: the event's own object
  std::string ca_file;    ///< the only authorities that are trusted; empty: the system's
  TlsUse tls = TlsUse::verified;
};

struct MqttSettings {
  std::string host;
  int port = 8883;
  std::string topic;  ///< in front of /availability, /state and /event
  std::string user, password;
  std::string ca_file;  ///< as WebhookSettings has it
  TlsUse tls = TlsUse::verified;
};

struct NotifySettings {
  std::vector<EventKind> events;  ///< to send; others are counted only
  std::uint64_t disk_low_bytes = 5'000'000'000;
  std::optional<WebhookSettings> webhook;
  std::optional<MqttSettings> mqtt;
};

/// `bench`: name of the rig, part of the default topic. Paths in the file are relative to its
/// folder. Errors: not_found, io; parse, with the first of all problems; wrong_state, a secret that
/// others may read.
Result<NotifySettings> load_notify_settings(const std::filesystem::path& file,
                                            const std::string& bench);

/// {run}, {title} and other keys of to_json(Event) are replaced by their values.
std::string expand(const std::string& text, const nlohmann::json& event);
/// Of a template that is a text: that text, expanded. Of an object or list: the same as JSON, with
/// each text in it expanded; a text that is one placeholder becomes its value, so that numbers stay
/// numbers.
std::string expand_body(const std::string& body_json, const nlohmann::json& event);

}  // namespace weft::daemon::notify
