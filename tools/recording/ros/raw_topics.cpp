// SPDX-License-Identifier: Apache-2.0
#include "ros/raw_topics.hpp"

#include <fmt/format.h>
#include <ros/service_callback_helper.h>

#include <boost/make_shared.hpp>
#include <cstring>
#include <utility>

#include "record/ros_bytes.hpp"

namespace ravencal::ros_io {
namespace {

// std_srvs/SetBool.srv and std_srvs/Trigger.srv.
constexpr const char* kSetBool = "std_srvs/SetBool";
constexpr const char* kSetBoolMd5 = "09fb03525b03e7ea1fd3992bafd87e16";
constexpr const char* kTrigger = "std_srvs/Trigger";
constexpr const char* kTriggerMd5 = "937c9679a518e3a18d831e57125ea522";

/// On the wire: 1 for a service that worked, the response's length, the response.
ros::SerializedMessage serialized(const Answer& answer) {
  record::RosWriter body;
  body.number(static_cast<std::uint8_t>(answer.success));
  body.text(answer.message);
  const std::vector<std::uint8_t> bytes = body.take();
  record::RosWriter whole;
  whole.number(std::uint8_t{1});
  whole.number(static_cast<std::uint32_t>(bytes.size()));
  std::vector<std::uint8_t> wire = whole.take();
  wire.insert(wire.end(), bytes.begin(), bytes.end());
  ros::SerializedMessage message;
  message.num_bytes = wire.size();
  message.buf.reset(new std::uint8_t[wire.size()]);
  std::memcpy(message.buf.get(), wire.data(), wire.size());
  return message;
}

class RawService final : public ros::ServiceCallbackHelper {
 public:
  explicit RawService(std::function<Answer(std::span<const std::uint8_t>)> call)
      : call_(std::move(call)) {}

  bool call(ros::ServiceCallbackHelperCallParams& params) override {
    params.response = serialized(call_({params.request.buf.get(), params.request.num_bytes}));
    return true;
  }

 private:
  std::function<Answer(std::span<const std::uint8_t>)> call_;
};

ros::ServiceServer serve(ros::NodeHandle& node, const std::string& name, const std::string& type,
                         const char* md5,
                         std::function<Answer(std::span<const std::uint8_t>)> call) {
  ros::AdvertiseServiceOptions options;
  options.service = name;
  options.datatype = type;
  options.md5sum = md5;
  options.req_datatype = type + "Request";
  options.res_datatype = type + "Response";
  options.helper = boost::make_shared<RawService>(std::move(call));
  return node.advertiseService(options);
}

}  // namespace

ros::Publisher advertise(ros::NodeHandle& node, const std::string& topic,
                         const record::RosMessageType& type, std::uint32_t queue) {
  ros::AdvertiseOptions options(topic, queue, std::string(type.md5), std::string(type.name),
                                std::string(type.definition));
  return node.advertise(options);
}

void publish(ros::Publisher& publisher, const record::RosMessageType& type,
             std::vector<std::uint8_t> bytes) {
  publisher.publish(record::RosRawMessage{&type, std::move(bytes)});
}

ros::Subscriber subscribe(ros::NodeHandle& node, const std::string& topic, std::uint32_t queue,
                          const TakeBytes& take) {
  const boost::function<void(const ros::MessageEvent<AnyMessage const>&)> on_message =
      [take](const ros::MessageEvent<AnyMessage const>& event) {
        const ros::M_string& header = event.getConnectionHeader();
        const auto field = [&](const char* key) {
          const auto found = header.find(key);
          return found == header.end() ? std::string() : found->second;
        };
        take(event.getConstMessage()->bytes, {field("type"), field("md5sum")});
      };
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const ros::MessageEvent<AnyMessage const>&>(topic, queue,
                                                                             on_message);
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  return node.subscribe(options);
}

ros::ServiceServer serve_trigger(ros::NodeHandle& node, const std::string& name,
                                 const std::function<Answer()>& call) {
  return serve(node, name, kTrigger, kTriggerMd5,
               [call](std::span<const std::uint8_t> /*request*/) { return call(); });
}

ros::ServiceServer serve_set_bool(ros::NodeHandle& node, const std::string& name,
                                  const std::function<Answer(bool)>& call) {
  return serve(node, name, kSetBool, kSetBoolMd5, [call](std::span<const std::uint8_t> request) {
    if (request.empty()) return Answer{false, "the request is empty"};
    return call(request.back() != 0);  // the only field
  });
}

std::string type_mismatch(const std::string& topic, const ReceivedType& received,
                          const record::RosMessageType& expected) {
  if (received.md5 == expected.md5) return {};
  return fmt::format(
      "{} is published as {} with md5 {}, but ravencal reads {} with md5 {}: another revision of "
      "the message",
      topic, received.name, received.md5, expected.name, expected.md5);
}

}  // namespace ravencal::ros_io
