// SPDX-License-Identifier: GPL-2.0-only OR Apache-2.0
/*
 * A quadrature counter chip without the chip, for the kernel's own counter subsystem: what is
 * written to count0/count is where the encoder has moved to, and is pushed to /dev/counterN as a
 * change of state. Module parameter events=0 gives a chip that can only be asked.
 */
#include <linux/counter.h>
#include <linux/module.h>
#include <linux/platform_device.h>

static bool events = true;
module_param(events, bool, 0644);

struct counter_sim {
	u64 count;
};

static int sim_count_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	*value = ((struct counter_sim *)counter_priv(counter))->count;
	return 0;
}

static int sim_count_write(struct counter_device *counter, struct counter_count *count, u64 value)
{
	((struct counter_sim *)counter_priv(counter))->count = value & U32_MAX;
	counter_push_event(counter, COUNTER_EVENT_CHANGE_OF_STATE, 0);
	return 0;
}

static int sim_function_read(struct counter_device *counter, struct counter_count *count,
			     enum counter_function *function)
{
	*function = COUNTER_FUNCTION_QUADRATURE_X4;
	return 0;
}

static int sim_action_read(struct counter_device *counter, struct counter_count *count,
			   struct counter_synapse *synapse, enum counter_synapse_action *action)
{
	*action = COUNTER_SYNAPSE_ACTION_BOTH_EDGES;
	return 0;
}

static int sim_signal_read(struct counter_device *counter, struct counter_signal *signal,
			   enum counter_signal_level *level)
{
	const u64 phase = ((struct counter_sim *)counter_priv(counter))->count & 3;
	const bool high = signal->id == 0 ? phase == 1 || phase == 2 : phase >= 2;

	*level = high ? COUNTER_SIGNAL_LEVEL_HIGH : COUNTER_SIGNAL_LEVEL_LOW;
	return 0;
}

static int sim_watch_validate(struct counter_device *counter, const struct counter_watch *watch)
{
	return events && watch->channel == 0 && watch->event == COUNTER_EVENT_CHANGE_OF_STATE ?
		       0 : -EINVAL;
}

static const struct counter_ops sim_ops = {
	.count_read = sim_count_read,
	.count_write = sim_count_write,
	.function_read = sim_function_read,
	.action_read = sim_action_read,
	.signal_read = sim_signal_read,
	.watch_validate = sim_watch_validate,
};

static int sim_ceiling_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	*value = U32_MAX;
	return 0;
}

static const enum counter_function functions[] = { COUNTER_FUNCTION_QUADRATURE_X4 };
static const enum counter_synapse_action actions[] = { COUNTER_SYNAPSE_ACTION_BOTH_EDGES };
static struct counter_comp count_ext[] = { COUNTER_COMP_CEILING(sim_ceiling_read, NULL) };
static struct counter_signal signals[] = { { .id = 0, .name = "A" }, { .id = 1, .name = "B" } };
static struct counter_synapse synapses[] = {
	{ .actions_list = actions, .num_actions = ARRAY_SIZE(actions), .signal = &signals[0] },
	{ .actions_list = actions, .num_actions = ARRAY_SIZE(actions), .signal = &signals[1] },
};
static struct counter_count counts[] = { {
	.name = "Encoder",
	.functions_list = functions,
	.num_functions = ARRAY_SIZE(functions),
	.synapses = synapses,
	.num_synapses = ARRAY_SIZE(synapses),
	.ext = count_ext,
	.num_ext = ARRAY_SIZE(count_ext),
} };

static int sim_probe(struct platform_device *pdev)
{
	struct counter_device *counter = devm_counter_alloc(&pdev->dev, sizeof(struct counter_sim));

	if (!counter)
		return -ENOMEM;
	counter->name = "counter-sim";
	counter->parent = &pdev->dev;
	counter->ops = &sim_ops;
	counter->signals = signals;
	counter->num_signals = ARRAY_SIZE(signals);
	counter->counts = counts;
	counter->num_counts = ARRAY_SIZE(counts);
	return devm_counter_add(&pdev->dev, counter);
}

static struct platform_driver sim_driver = {
	.driver = { .name = "counter-sim" },
	.probe = sim_probe,
};
static struct platform_device *sim_device;

static int __init sim_init(void)
{
	const int error = platform_driver_register(&sim_driver);

	if (error)
		return error;
	sim_device = platform_device_register_simple("counter-sim", PLATFORM_DEVID_NONE, NULL, 0);
	if (IS_ERR(sim_device)) {
		platform_driver_unregister(&sim_driver);
		return PTR_ERR(sim_device);
	}
	return 0;
}

static void __exit sim_exit(void)
{
	platform_device_unregister(sim_device);
	platform_driver_unregister(&sim_driver);
}

module_init(sim_init);
module_exit(sim_exit);
MODULE_DESCRIPTION("Simulated quadrature counter");
MODULE_IMPORT_NS(COUNTER);
MODULE_LICENSE("GPL");
