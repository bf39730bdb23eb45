/* A device in plain C: its controls stay as they were configured. Shows what the C++ layer does for a plugin.
 */
#include <calot/abi/plugin.h>

#include <stdlib.h>
#include <string.h>

static const char id[] = "org.calot.test.c-device";
static const char title[] = "Test: a device in C";
static const char version[] = "0.1.0";

enum life { CREATED, INITIALISED, CONFIGURED, ACTIVE };

typedef struct still_device {
    enum life life;
    calot_controls controls;
} still_device;

static calot_string text(const char* s) {
    calot_string out = {s, strlen(s)};
    return out;
}

static calot_status fail(calot_error* error, int32_t code, const char* field, const char* message) {
    if (error != NULL) {
        error->code = code;
        strncpy(error->field, field, sizeof error->field - 1);
        error->field[sizeof error->field - 1] = '\0';
        strncpy(error->message, message, sizeof error->message - 1);
        error->message[sizeof error->message - 1] = '\0';
    }
    return CALOT_ERROR;
}

static calot_status wrong_state(calot_error* error, const char* function) {
    return fail(error, CALOT_CODE_WRONG_STATE, function, "can not be called in this state");
}

static calot_status device_init(void* self, calot_error* error) {
    still_device* d = self;
    if (d->life != CREATED) return wrong_state(error, "init");
    d->life = INITIALISED;
    return CALOT_OK;
}

static calot_status device_activate(void* self, const calot_activation* activation, calot_error* error) {
    still_device* d = self;
    (void)activation;
    if (d->life != CONFIGURED) return wrong_state(error, "activate");
    d->life = ACTIVE;
    return CALOT_OK;
}

static calot_status device_deactivate(void* self, calot_error* error) {
    still_device* d = self;
    if (d->life != ACTIVE) return wrong_state(error, "deactivate");
    d->life = CONFIGURED;
    return CALOT_OK;
}

static calot_status device_reset(void* self, uint64_t seed, calot_error* error) {
    still_device* d = self;
    (void)seed;
    return d->life == ACTIVE ? CALOT_OK : wrong_state(error, "reset");
}

static void device_destroy(void* self) {
    free(self);
}

/* Nothing but the magic: the controls never change after configure. */
static const uint8_t state[8] = {'S', 'T', 'I', 'L', 'L', '0', '0', '1'};

static calot_status device_save(void* self, const calot_sink* sink, calot_error* error) {
    still_device* d = self;
    calot_bytes bytes = {state, sizeof state};
    if (d->life != ACTIVE) return wrong_state(error, "save_state");
    return sink->write(sink->self, bytes) == CALOT_OK
               ? CALOT_OK
               : fail(error, CALOT_CODE_CAPACITY, "sink", "the sink did not take the state");
}

static calot_status device_load(void* self, const calot_source* source, calot_error* error) {
    still_device* d = self;
    uint8_t got[sizeof state + 1];
    uint64_t size = 0;
    if (d->life != ACTIVE) return wrong_state(error, "load_state");
    while (size < sizeof got) {
        calot_bytes_out rest = {got + size, sizeof got - size};
        uint64_t n = source->read(source->self, rest);
        if (n == 0 || n > rest.size) break;
        size += n;
    }
    if (size != sizeof state || memcmp(got, state, sizeof state) != 0)
        return fail(error, CALOT_CODE_CORRUPT_STATE, "state", "is not a state of this device");
    return CALOT_OK;
}

static uint32_t parameter_count(void* self) {
    (void)self;
    return 0;
}

static calot_status no_such_parameter(calot_error* error) {
    return fail(error, CALOT_CODE_OUT_OF_RANGE, "index", "no parameter has this index");
}

static calot_status parameter_info(void* self, uint32_t index, calot_parameter* out, calot_error* error) {
    (void)self, (void)index, (void)out;
    return no_such_parameter(error);
}

static calot_status get_parameter(void* self, uint32_t index, double* out, calot_error* error) {
    (void)self, (void)index, (void)out;
    return no_such_parameter(error);
}

static calot_status set_parameter(void* self, uint32_t index, double value, calot_error* error) {
    (void)self, (void)index, (void)value;
    return no_such_parameter(error);
}

static const void* extension(void* self, calot_string name) {
    (void)self, (void)name;
    return NULL;
}

static calot_status sheet(void* self, calot_device_sheet* out, calot_error* error) {
    still_device* d = self;
    uint64_t size = out->struct_size;
    if (d->life == CREATED) return wrong_state(error, "sheet");
    memset(out, 0, sizeof *out);
    out->struct_size = size;
    out->title = text(title);
    out->in_lockstep = 1;
    out->rate = 1000;
    return CALOT_OK;
}

static calot_status configure(void* self, const calot_controls* start, calot_error* error) {
    still_device* d = self;
    if (d->life != INITIALISED && d->life != CONFIGURED) return wrong_state(error, "configure");
    d->controls = *start;
    d->life = CONFIGURED;
    return CALOT_OK;
}

static calot_status poll(void* self, int64_t tick, calot_controls* out, calot_error* error) {
    still_device* d = self;
    uint64_t size = out->struct_size;
    (void)tick;
    if (d->life != ACTIVE) return wrong_state(error, "poll");
    *out = d->controls;
    out->struct_size = size;
    return CALOT_OK;
}

static calot_status send(void* self, const calot_feedback* feedback, calot_error* error) {
    still_device* d = self;
    (void)feedback;
    return d->life == ACTIVE ? CALOT_OK : wrong_state(error, "send");
}

static const calot_device device = {sizeof(calot_device), sheet, configure, poll, send};

static uint32_t count(void* self) {
    (void)self;
    return 1;
}

static calot_status info(void* self, uint32_t index, calot_model_info* out, calot_error* error) {
    (void)self;
    if (index != 0 || out == NULL)
        return fail(error, CALOT_CODE_OUT_OF_RANGE, "index", "there is no such model");
    out->id = text(id);
    out->title = text(title);
    out->version = text(version);
    return CALOT_OK;
}

static calot_status create(void* self, calot_string name, const calot_host* host, calot_instance* out,
                           calot_error* error) {
    const calot_instance made = {sizeof(calot_instance),
                                 calloc(1, sizeof(still_device)),
                                 &device,
                                 device_init,
                                 device_activate,
                                 device_deactivate,
                                 device_reset,
                                 device_destroy,
                                 device_save,
                                 device_load,
                                 parameter_count,
                                 parameter_info,
                                 get_parameter,
                                 set_parameter,
                                 extension};
    (void)self, (void)host;
    if (name.size != strlen(id) || memcmp(name.data, id, name.size) != 0) {
        free(made.self);
        return fail(error, CALOT_CODE_UNSUPPORTED, "id", "this library has no model with this id");
    }
    if (made.self == NULL) return fail(error, CALOT_CODE_CAPACITY, "memory", "not enough memory");
    *out = made;
    return CALOT_OK;
}

static const calot_factory factory = {sizeof(calot_factory), NULL, count, info, create};

static const calot_factory* find_factory(void* self, calot_string kind) {
    (void)self;
    if (kind.size != strlen(CALOT_KIND_DEVICE) || memcmp(kind.data, CALOT_KIND_DEVICE, kind.size) != 0)
        return NULL;
    return &factory;
}

CALOT_EXPORT const calot_descriptor calot_plugin_descriptor = {
    {'C', 'A', 'L', 'O', 'T', 'P', 'L', 'G'}, CALOT_ABI_MAJOR, CALOT_ABI_MINOR, CALOT_ABI_FINGERPRINT};

CALOT_EXPORT calot_status calot_plugin_entry(const calot_host* host, calot_library* out, calot_error* error) {
    if (host->abi_major != CALOT_ABI_MAJOR || host->abi_minor != CALOT_ABI_MINOR ||
        host->abi_fingerprint != CALOT_ABI_FINGERPRINT)
        return fail(error, CALOT_CODE_VERSION, "host.abi_minor", "the host speaks another version");
    out->self = NULL;
    out->factory = find_factory;
    return CALOT_OK;
}
