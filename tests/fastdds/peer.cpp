// Fast DDS as an equal partner: it knows the standard messages, and nothing of backdrive.
//
//   peer pass SECONDS DOMAIN [TOPIC:TYPE:QOS ...]   hears what the domain of ROS_DOMAIN_ID says, until nothing has come for 2 s, at most SECONDS,
//                                                   and publishes it in another DOMAIN, once each topic is listened to there
//
// TYPE is JointState or Log; QOS is best_effort or reliable. The last line is JSON: count, first and last number and order by topic.
//
//   g++ -O1 -o peer tests/fastdds/peer.cpp -lfastrtps -lfastcdr        (on Debian: apt install libfastrtps-dev)

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Clock = std::chrono::steady_clock;

struct Message {
    virtual ~Message() = default;
    virtual void write(Cdr &cdr) const = 0;
    virtual void read(Cdr &cdr) = 0;
    /// Where backdrive puts what standard messages have no field for.
    virtual const std::string &text() const = 0;
};

struct JointState : Message {
    int32_t sec = 0;
    uint32_t nanosec = 0;
    std::string frame_id;
    std::vector<std::string> name;
    std::vector<double> position, velocity, effort;

    void write(Cdr &cdr) const override { cdr << sec << nanosec << frame_id << name << position << velocity << effort; }
    void read(Cdr &cdr) override { cdr >> sec >> nanosec >> frame_id >> name >> position >> velocity >> effort; }
    const std::string &text() const override { return frame_id; }
};

struct LogLine : Message {
    int32_t sec = 0;
    uint32_t nanosec = 0, line = 0;
    uint8_t level = 0;
    std::string name, msg, file, function;

    void write(Cdr &cdr) const override { cdr << sec << nanosec << level << name << msg << file << function << line; }
    void read(Cdr &cdr) override { cdr >> sec >> nanosec >> level >> name >> msg >> file >> function >> line; }
    const std::string &text() const override { return file; }
};

template <class T>
class Type : public TopicDataType {
  public:
    explicit Type(const char *type_name) {
        setName(type_name);
        m_typeSize = 65536;
        m_isGetKeyDefined = false;
    }
    bool serialize(void *data, SerializedPayload_t *payload) override {
        FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->max_size);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        payload->encapsulation = cdr.endianness() == Cdr::BIG_ENDIANNESS ? CDR_BE : CDR_LE;
        cdr.serialize_encapsulation();
        static_cast<T *>(data)->write(cdr);
        payload->length = static_cast<uint32_t>(cdr.getSerializedDataLength());
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override {
        try {
            FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->length);
            Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
            cdr.read_encapsulation();
            static_cast<T *>(data)->read(cdr);
            return true;
        } catch (const eprosima::fastcdr::exception::Exception &error) {
            std::fprintf(stderr, "%s: %s\n", getName(), error.what());
            return false;
        }
    }
    std::function<uint32_t()> getSerializedSizeProvider(void *) override {
        return [this]() { return m_typeSize; };
    }
    void *createData() override { return new T; }
    void deleteData(void *data) override { delete static_cast<T *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

[[noreturn]] void fail(const std::string &why) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::exit(1);
}

template <class T>
T *made(T *what, const std::string &name) {
    if (what == nullptr) fail(name + ": Fast DDS makes none");
    return what;
}

template <class Qos>
void like_ours(Qos &qos, bool reliable) {
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = reliable ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = reliable ? 1000 : 20000;
    qos.resource_limits().max_samples = 20000;
    qos.resource_limits().max_instances = 1;
    qos.resource_limits().max_samples_per_instance = 20000;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
}

struct Side {
    DomainParticipant *participant;
    Publisher *publisher;
    Subscriber *subscriber;

    explicit Side(uint32_t domain) {
        participant = made(DomainParticipantFactory::get_instance()->create_participant(domain, PARTICIPANT_QOS_DEFAULT), "participant");
        TypeSupport(new Type<JointState>("sensor_msgs::msg::dds_::JointState_")).register_type(participant);
        TypeSupport(new Type<LogLine>("rcl_interfaces::msg::dds_::Log_")).register_type(participant);
        publisher = made(participant->create_publisher(PUBLISHER_QOS_DEFAULT), "publisher");
        subscriber = made(participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT), "subscriber");
    }
    Topic *topic(const std::string &name, bool log) {
        const char *type = log ? "rcl_interfaces::msg::dds_::Log_" : "sensor_msgs::msg::dds_::JointState_";
        return made(participant->create_topic("rt" + name, type, TOPIC_QOS_DEFAULT), name);
    }
};

struct Lane {
    std::string name;
    DataReader *reader;
    DataWriter *writer;
    std::unique_ptr<Message> message;
    std::vector<long> numbers;
};

long number_of(const std::string &text) {
    auto at = text.find("seq=");
    if (at == std::string::npos) fail("no number in `" + text + "`");
    return std::atol(text.c_str() + at + 4);
}

int main(int count, char **words) {
    if (count < 5 || std::string(words[1]) != "pass") fail("say: pass SECONDS DOMAIN TOPIC:TYPE:QOS ...");
    const char *domain = std::getenv("ROS_DOMAIN_ID");
    Side from(domain ? std::atoi(domain) : 0), to(std::atoi(words[3]));
    std::vector<Lane> lanes;
    for (int i = 4; i < count; ++i) {
        std::string entry = words[i];
        auto first = entry.find(':'), second = entry.rfind(':');
        if (first == second) fail(entry + ": is not TOPIC:TYPE:QOS");
        std::string name = entry.substr(0, first);
        bool log = entry.substr(first + 1, second - first - 1) == "Log", reliable = entry.substr(second + 1) == "reliable";
        DataReaderQos reads = DATAREADER_QOS_DEFAULT;
        DataWriterQos writes = DATAWRITER_QOS_DEFAULT;
        like_ours(reads, reliable);
        like_ours(writes, reliable);
        std::unique_ptr<Message> message;
        if (log) message = std::make_unique<LogLine>(); else message = std::make_unique<JointState>();
        auto *reader = made(from.subscriber->create_datareader(from.topic(name, log), reads), name);
        auto *writer = made(to.publisher->create_datawriter(to.topic(name, log), writes), name);
        lanes.push_back({name, reader, writer, std::move(message), {}});
    }
    auto begun = Clock::now();
    auto waits = [&](double seconds) { return std::chrono::duration<double>(Clock::now() - begun).count() < seconds; };
    for (Lane &lane : lanes) {
        PublicationMatchedStatus status;
        while (lane.writer->get_publication_matched_status(status) == ReturnCode_t::RETCODE_OK && status.current_count == 0) {
            if (!waits(20)) fail(lane.name + ": nobody listens");
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    // The other end may hear of this one a little later.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    std::printf("listening\n");
    std::fflush(stdout);

    begun = Clock::now();
    auto quiet = begun;
    bool any = false;
    while (waits(std::atof(words[2])) && (!any || Clock::now() - quiet < std::chrono::seconds(2))) {
        for (Lane &lane : lanes) {
            SampleInfo info;
    
            void *into = dynamic_cast<void *>(lane.message.get());
            while (lane.reader->take_next_sample(into, &info) == ReturnCode_t::RETCODE_OK) {
                if (!info.valid_data) continue;
                lane.numbers.push_back(number_of(lane.message->text()));
                lane.writer->write(into);
                any = true;
                quiet = Clock::now();
            }
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    // What was published last has to arrive before its writer goes.
    std::this_thread::sleep_for(std::chrono::seconds(1));
    std::string told = "{";
    for (Lane &lane : lanes) {
        auto &n = lane.numbers;
        long first = n.empty() ? -1 : *std::min_element(n.begin(), n.end()), last = n.empty() ? -1 : *std::max_element(n.begin(), n.end());
        told += (told.size() > 1 ? ", \"" : "\"") + lane.name + "\": {\"count\": " + std::to_string(n.size()) + ", \"first\": " + std::to_string(first);
        told += ", \"last\": " + std::to_string(last) + ", \"ordered\": " + (std::is_sorted(n.begin(), n.end()) ? "true" : "false") + "}";
    }
    std::printf("%s}\n", told.c_str());
}
