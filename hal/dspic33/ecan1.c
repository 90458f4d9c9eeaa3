#include "ecan1.h"

#include <string.h>

#include "board.h"
#include "handlers.h"
#include "part.h"
#include "ring.h"
#include "sys.h"

/* --- bit timing [PDCP 2.2]: 1 Mbit/s, sampled at 75 to 80 % of the bit --- */

#define CAN_CLOCK BOARD_FCY
#define BITRATE 1000000uL
/* A time quantum is 2 * (BRP + 1) clocks, a bit 8 to 25 quanta: the smallest BRP that fits resynchronises
 * best. */
#define CLOCK_PAIRS (CAN_CLOCK / 2u / BITRATE)
#define BRP_PLUS_1 (CLOCK_PAIRS <= 25u ? 1u : CLOCK_PAIRS % 2u == 0 ? 2u : CLOCK_PAIRS % 3u == 0 ? 3u : 5u)
#define QUANTA (CLOCK_PAIRS / BRP_PLUS_1)
#define SEGMENT_2 (QUANTA / 4u)
/* Propagation and segment 1; one quantum is the synchronisation. */
#define BEFORE_SAMPLE (QUANTA - 1u - SEGMENT_2)
#define SEGMENT_1 (BEFORE_SAMPLE / 2u)
#define PROPAGATION (BEFORE_SAMPLE - SEGMENT_1)
#define JUMP (SEGMENT_2 < 4u ? SEGMENT_2 : 4u)

PART_ASSERT(ecan1_bitrate_exact, BITRATE * 2u * BRP_PLUS_1 * QUANTA == CAN_CLOCK);
PART_ASSERT(ecan1_quanta_in_range, QUANTA >= 8u && QUANTA <= 25u);
PART_ASSERT(ecan1_segments_in_range,
            SEGMENT_1 <= 8u && PROPAGATION <= 8u && SEGMENT_2 >= 2u && SEGMENT_2 <= 8u);
PART_ASSERT(ecan1_segments_in_proportion, BEFORE_SAMPLE >= SEGMENT_2 && SEGMENT_2 >= JUMP);
PART_ASSERT(ecan1_sample_point,
            (QUANTA - SEGMENT_2) * 100u >= QUANTA * 75u && (QUANTA - SEGMENT_2) * 100u <= QUANTA * 80u);

#define CFG1 ((uint16_t)((JUMP - 1u) << 6 | (BRP_PLUS_1 - 1u)))
#define CFG2 ((uint16_t)((SEGMENT_2 - 1u) << 8 | 0x80u | (SEGMENT_1 - 1u) << 3 | (PROPAGATION - 1u)))

/* --- buffers --- */

enum {
    BUFFERS = 32,
    WORDS = 8, /* of one buffer */
    FIFO_FIRST = 8,
    PRIORITIES = 4,
    TX_PLACES = 4, /* of one priority */
    RX_PLACES = PART_CAN_RX_PLACES,
    MODE_NORMAL = 0,
    MODE_DISABLED = 1,
    MODE_CONFIGURATION = 4,
    MODE_WAIT_ROUNDS = 8000, /* of at least 5 cycles: 1 ms; the change takes two bit times */
    UNUSED = 0xFFFF          /* word 0 of a buffer that holds no frame: its upper bits are always 0 in one */
};

/* C1INTF, C1INTE */
enum {
    INTF_TB = 0x0001,
    INTF_RB = 0x0002,
    INTF_RBOV = 0x0004,
    INTF_FIFO = 0x0008,
    INTF_ERR = 0x0020,
    INTF_WAK = 0x0040,
    INTF_IVR = 0x0080,
    INTF_RXBP = 0x0800,
    INTF_TXBP = 0x1000,
    INTF_TXBO = 0x2000,
    INTF_FLAGS = INTF_TB | INTF_RB | INTF_RBOV | INTF_FIFO | INTF_ERR | INTF_WAK | INTF_IVR
};

/* C1TRmnCON, lower half: one buffer a register, the even ones, so that a request is one write of the whole
 * register and never touches a bit that the controller clears. */
enum { TX_ENABLE = 0x0080, TX_REQUEST = 0x0008 };

/* A buffer in memory: word 0 = SID10..0 at bit 2, SRR, IDE; word 1 = EID17..6; word 2 = EID5..0 at bit 10,
 * RTR, DLC; words 3 to 6 = data, LSB first; word 7 = number of the filter. */
enum { W0_IDE = 0x0001, W0_SRR = 0x0002, W2_RTR = 0x0200, W2_DLC = 0x000F };

static volatile uint16_t ecan1_buffers[BUFFERS][WORDS] PART_DMA_MEMORY(512);

/* A frame in a queue: what a buffer holds, without the extended identifier. */
typedef struct {
    uint16_t word_0;
    uint16_t word_2;
    uint16_t data[4];
} raw_frame_t;

typedef struct {
    ring_t ring;
    raw_frame_t frames[TX_PLACES];
} tx_queue_t;

struct hal_can {
    ring_t rx_ring;
    const ring_t *refused; /* the queue that did not take the last frame; NULL: it was taken */
    volatile uint8_t errors_seen;
    uint8_t errors_told;
    volatile hal_can_health_t health; /* counters of frames; bus-off from there to the restart; down */
    tx_queue_t tx_queues[PRIORITIES]; /* the first frame of each stands in the buffer of its priority, too */
    raw_frame_t rx_frames[RX_PLACES];
};

static struct hal_can ecan1;

/* --- set-up --- */

/* The rounds that were left of its wait; 0: the mode was not entered. */
static uint16_t enter_configuration(void)
{
    uint16_t rounds = MODE_WAIT_ROUNDS;
    C1CTRL1bits.REQOP = MODE_CONFIGURATION;
    while (C1CTRL1bits.OPMODE != MODE_CONFIGURATION && --rounds != 0) {
    }
    return rounds;
}

/* Peripheral indirect: the controller says which buffer, the buffers' common address has zeros in those
 * bits. */
static void start_dma(void)
{
    PART_DMA_PREPARE();
    DMA0CON = 0x0020; /* words, peripheral to RAM, peripheral indirect, continuous */
    DMA0PAD = (uint16_t)(uintptr_t)&C1RXD;
    DMA0CNT = WORDS - 1;
    DMA0REQ = 0x0022;
    PART_DMA0_START(ecan1_buffers);
    DMA0CONbits.CHEN = 1;
    DMA1CON = 0x2020; /* the same, RAM to peripheral */
    DMA1PAD = (uint16_t)(uintptr_t)&C1TXD;
    DMA1CNT = WORDS - 1;
    DMA1REQ = 0x0046;
    PART_DMA1_START(ecan1_buffers);
    DMA1CONbits.CHEN = 1;
}

/* Filter 0 with mask 0 takes every frame of either kind into the FIFO. */
static void accept_all(void)
{
    C1CTRL1bits.WIN = 1;
    C1FMSKSEL1 = 0;
    C1RXM0SID = 0; /* no bit is compared, MIDE = 0: base and extended */
    C1RXM0EID = 0;
    C1RXF0SID = 0;
    C1RXF0EID = 0;
    C1BUFPNT1 = 0x000F; /* to the FIFO */
    C1CTRL1bits.WIN = 0;
    C1FEN1 = 0x0001;
}

/* Byte by byte, the start of the FIFO first: the larger part takes no word here. */
static void set_fifo(void)
{
    volatile uint8_t *halves = (volatile uint8_t *)&C1FCTRL;
    halves[0] = FIFO_FIRST;
    halves = (volatile uint8_t *)&C1FCTRL;
    halves[1] = 0xC0; /* DMABS = 6: 32 buffers */
}

static void clear_flags(void)
{
    C1RXFUL1 = 0;
    C1RXFUL2 = 0;
    C1RXOVF1 = 0;
    C1RXOVF2 = 0;
    C1INTF = 0;
}

/* The buffer of a priority; 0 is the most urgent. */
PART_INLINE volatile uint16_t *tx_control(uint8_t priority)
{
    return &C1TR01CON + priority;
}

/* The transmit buffers are taken back before their queues are emptied: nothing of them may leave later. */
static void drop_all(void)
{
    for (uint8_t priority = 0; priority < PRIORITIES; priority++) {
        ring_t *ring = &ecan1.tx_queues[priority].ring;
        *tx_control(priority) = (uint16_t)(TX_ENABLE | (PRIORITIES - 1u - priority));
        ecan1.health.tx_failed += ring_count(ring);
        ring->tail = ring->head;
    }
}

hal_can_t *ecan1_open(void)
{
    IEC2bits.C1IE = 0;
    memset(&ecan1, 0, sizeof ecan1);
    if (enter_configuration() == 0) {
        ecan1.health.state = HAL_CAN_DOWN;
        return &ecan1;
    }
    C1CTRL1bits.CANCKS = PART_CAN_CANCKS;
    C1CFG1 = CFG1;
    C1CFG2 = CFG2;
    set_fifo();
    accept_all();
    for (uint8_t i = 0; i < BUFFERS; i++) {
        ecan1_buffers[i][0] = UNUSED;
    }
    start_dma();
    drop_all();
    clear_flags();
    C1INTE = INTF_TB | INTF_RB | INTF_RBOV | INTF_ERR | INTF_IVR;
    IPC8bits.C1IP = PART_LEVEL_CAN;
    IFS2bits.C1IF = 0;
    IEC2bits.C1IE = 1;
    C1CTRL1bits.REQOP = MODE_NORMAL; /* entered after 11 recessive bits, however long they take */
    return &ecan1;
}

/* --- out --- */

/* The first frame of a queue into its buffer. */
static void load(uint8_t priority)
{
    const tx_queue_t *queue = &ecan1.tx_queues[priority];
    const raw_frame_t *raw = &queue->frames[ring_place(queue->ring.tail, TX_PLACES)];
    volatile uint16_t *words = ecan1_buffers[priority * 2];
    words[0] = raw->word_0;
    words[1] = 0;
    words[2] = raw->word_2;
    words[3] = raw->data[0];
    words[4] = raw->data[1];
    words[5] = raw->data[2];
    words[6] = raw->data[3];
    *tx_control(priority) = (uint16_t)(TX_ENABLE | TX_REQUEST | (PRIORITIES - 1u - priority));
}

/* Takes the frames that have left out of their queues and loads the next ones. */
PART_INLINE void advance_tx(void)
{
    for (uint8_t priority = 0; priority < PRIORITIES; priority++) {
        ring_t *ring = &ecan1.tx_queues[priority].ring;
        if (ring_count(ring) != 0 && (*tx_control(priority) & TX_REQUEST) == 0) {
            ring->tail++;
            if (ring_count(ring) != 0) {
                load(priority);
            }
        }
    }
}

/* With the handler off: it takes frames out of the queue, and finds that the bus is off. */
bool hal_can_send(hal_can_t *can, const can_frame_t *frame)
{
    const uint16_t id = frame->id;
    const uint8_t priority = (uint8_t)(id >> 9);
    tx_queue_t *queue = &can->tx_queues[priority];
    const unsigned int saved = sys_lock();
    const uint8_t waiting = ring_count(&queue->ring);
    can->refused = &queue->ring;
    if (waiting != TX_PLACES && can->health.state == HAL_CAN_ACTIVE) {
        raw_frame_t *raw = &queue->frames[ring_place(queue->ring.head, TX_PLACES)];
        can->refused = NULL;
        raw->word_0 = (uint16_t)(id << 2);
        raw->word_2 = frame->dlc;
        memcpy(raw->data, frame->data, sizeof raw->data); /* either has the LSB first */
        queue->ring.head++;
        if (waiting == 0) {
            load(priority);
        }
    }
    sys_unlock(saved);
    return can->refused == NULL;
}

/* --- in --- */

/* The register of a buffer's flag. A flag is cleared by writing 0; a 1 leaves it alone. */
PART_INLINE volatile uint16_t *full_flags(uint8_t buffer)
{
    return buffer < 16 ? &C1RXFUL1 : &C1RXFUL2;
}

PART_INLINE uint16_t flag_of(uint8_t buffer)
{
    return (uint16_t)(1u << (buffer & 15u));
}

PART_INLINE void take_buffer(uint8_t buffer)
{
    volatile uint16_t *words = ecan1_buffers[buffer];
    ring_t *ring = &ecan1.rx_ring;
    if (words[0] == UNUSED) {
        ecan1.health.rx_overruns++; /* DMA put it elsewhere */
    } else {
        raw_frame_t *place = &ecan1.rx_frames[ring_place(ring->head, RX_PLACES)];
        place->word_0 = words[0];
        place->word_2 = words[2];
        place->data[0] = words[3];
        place->data[1] = words[4];
        place->data[2] = words[5];
        place->data[3] = words[6];
        ring->head++;
    }
    words[0] = UNUSED;
    *full_flags(buffer) = (uint16_t)~flag_of(buffer);
}

PART_INLINE bool fifo_holds_frames(void)
{
    return ((C1RXFUL1 >> FIFO_FIRST) | C1RXFUL2) != 0;
}

/* D-MCU-1: what finds no place in the ring stays in the FIFO until hal_can_receive has made room. After an
 * overflow the controller's pointer may stand at an empty buffer. */
PART_INLINE void drain_fifo(void)
{
    while (fifo_holds_frames() && ring_count(&ecan1.rx_ring) != RX_PLACES) {
        uint8_t buffer = (uint8_t)C1FIFObits.FNRB;
        while ((*full_flags(buffer) & flag_of(buffer)) == 0) {
            buffer = buffer == BUFFERS - 1 ? FIFO_FIRST : (uint8_t)(buffer + 1);
        }
        take_buffer(buffer);
    }
}

/* Clears a register of overflow flags, and counts those that were set. */
static void count_overflows(volatile uint16_t *flags)
{
    uint16_t bits = *flags;
    *flags = (uint16_t)~bits;
    for (; bits != 0; bits &= (uint16_t)(bits - 1u)) {
        ecan1.health.rx_overruns++;
    }
}

static void decode(const raw_frame_t *raw, can_frame_t *frame)
{
    const uint8_t dlc = (uint8_t)(raw->word_2 & W2_DLC);
    frame->id = 0;
    frame->dlc = dlc > CAN_FRAME_DATA_MAX ? CAN_FRAME_DATA_MAX : dlc;
    memcpy(frame->data, raw->data, sizeof frame->data);
    if ((raw->word_0 & (W0_IDE | W0_SRR)) == 0) {
        frame->kind = CAN_FRAME_BASE;
        frame->id = (uint16_t)(raw->word_0 >> 2);
    } else if ((raw->word_0 & W0_IDE) != 0 && (raw->word_2 & W2_RTR) == 0) {
        frame->kind = CAN_FRAME_EXTENDED;
    } else {
        frame->kind = CAN_FRAME_REMOTE;
    }
}

size_t hal_can_receive(hal_can_t *can, can_frame_t *frames, size_t max)
{
    ring_t *ring = &can->rx_ring;
    size_t count = 0;
    for (; count < max && ring_count(ring) != 0; count++) {
        decode(&can->rx_frames[ring_place(ring->tail, RX_PLACES)], frames++);
        ring->tail++;
    }
    if (fifo_holds_frames()) {
        IFS2bits.C1IF = 1; /* runs the handler: there is room in the ring now */
    }
    for (; count < max && can->errors_told != can->errors_seen; count++) {
        can->errors_told++;
        *frames++ = (can_frame_t){.kind = CAN_FRAME_ERROR};
    }
    return count;
}

/* Everything is accepted: filters of the controller see no remote bit, so they could not let all remote
 * frames through, as hal_can.h wants it. */
void hal_can_set_filters(hal_can_t *can, const hal_can_filter_t *filters, size_t n)
{
    (void)can;
    (void)filters;
    (void)n;
}

bool ecan1_has_work(const hal_can_t *can)
{
    return ring_count(&can->rx_ring) != 0 || can->errors_told != can->errors_seen ||
           (can->refused != NULL && can->health.state == HAL_CAN_ACTIVE &&
            ring_count(can->refused) != TX_PLACES);
}

/* --- errors --- */

void hal_can_restart(hal_can_t *can)
{
    const unsigned int saved = sys_lock();
    if (can->health.state == HAL_CAN_BUS_OFF) {
        can->health.state = HAL_CAN_ACTIVE;
        C1CTRL1bits.REQOP = MODE_NORMAL;
    }
    sys_unlock(saved);
}

hal_can_health_t hal_can_health(const hal_can_t *can)
{
    const unsigned int saved = sys_lock(); /* counters of two words */
    hal_can_health_t health = can->health;
    sys_unlock(saved);
    const uint16_t flags = C1INTF;
    const uint16_t counters = C1EC;
    health.tx_errors = (uint8_t)(counters >> 8);
    health.rx_errors = (uint8_t)counters;
    if (health.state == HAL_CAN_ACTIVE && (flags & INTF_TXBO) != 0) {
        health.state = HAL_CAN_BUS_OFF;
    } else if (health.state == HAL_CAN_ACTIVE && (flags & (INTF_TXBP | INTF_RXBP)) != 0) {
        health.state = HAL_CAN_PASSIVE;
    }
    return health;
}

/* Flags are cleared before the work they stand for: what comes during the work sets them again.
 * 242 cycles with one frame in and one out, 6.1 us. Some 100 for each further frame that waits, so 65 us
 * with a full FIFO, when handlers were off or the ring was full for a millisecond. */
void PART_HANDLER _C1Interrupt(void)
{
    IFS2bits.C1IF = 0;
    const uint16_t flags = C1INTF & INTF_FLAGS;
    C1INTF = (uint16_t)~flags;
    if ((flags & INTF_RBOV) != 0) {
        count_overflows(&C1RXOVF1);
        count_overflows(&C1RXOVF2);
    }
    drain_fifo();
    if ((flags & INTF_IVR) != 0 && (uint8_t)(ecan1.errors_seen - ecan1.errors_told) != UINT8_MAX) {
        ecan1.errors_seen++;
    }
    if ((flags & INTF_ERR) != 0 && (C1INTF & INTF_TXBO) != 0) {
        drop_all();
        ecan1.health.state = HAL_CAN_BUS_OFF;
        C1CTRL1bits.REQOP = MODE_DISABLED; /* keeps the error counters */
    }
    if ((flags & INTF_TB) != 0) {
        advance_tx();
    }
}
