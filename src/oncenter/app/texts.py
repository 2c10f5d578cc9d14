"""All texts of the page: a translation is one more table."""

from __future__ import annotations

from collections.abc import Mapping

ENGLISH: Mapping[str, str] = {
    "title": "oncenter",
    "about": "Is the steering wheel angle sensor straight? Choose the truck and drop a log of ordinary driving.",
    "truck": "1. The truck",
    "known_trucks": "Trucks of this computer and examples",
    "choose": "Choose a truck",
    "yours": "Your trucks",
    "shipped": "Examples",
    "unknown": "I don't know the truck",
    "another_truck": "Another truck",
    "may_be_empty": "Leave empty what you don't know: the drive shows wheelbase times ratio, and the interval is a "
    "little wider.",
    "name": "Name or number plate",
    "name_where": "How you want to find it next time.",
    "wheelbase_m": "Wheelbase",
    "wheelbase_m_where": "From the front axle to the middle of the driven axle or axles, in the body builder's "
    "drawing. Usually 3.5 to 6.5 m.",
    "steering_ratio": "Steering ratio",
    "steering_ratio_where": "Turns of the steering wheel for one turn of the front wheels, in the data sheet of the "
    "steering gear. Usually 16 to 24.",
    "axle_layout": "Axles",
    "axle_layout_where": "Wheels x driven wheels.",
    "traffic_side": "Driven on",
    "traffic_side_where": "The side of the road: its slope moves the steering wheel.",
    "right": "the right side",
    "left": "the left side",
    "databases": "CAN database, if the network is not J1939",
    "databases_where": "A file .dbc, .kcd, .sym or .arxml. Drop a log of this truck below first: it decides between "
    "signals of similar names.",
    "found": "Found in the log and the database. Check them in the report:",
    "save_truck": "Keep this truck",
    "logs": "2. The logs",
    "drop": "Drop logs here, or choose files",
    "drop_where": "One drive, or several drives of the same truck. Ordinary driving with bends to both sides, twenty "
    "minutes or more.",
    "remove": "remove",
    "cancel": "Cancel",
    "answer": "3. The answer",
    "limit": "Limit (deg)",
    "limit_where": "Recalibrate from this offset on. 2 deg, if the truck's maker gives no other.",
    "applied": "Correction that is already applied (deg)",
    "applied_where": "What the control unit adds to the sensor's reading today, by the diagnostic tool. Empty "
    "for none.",
    "more": "Limit and correction",
    "estimate": "Estimate the offset",
    "reading": "Reading and estimating …",
    "of": "of",
    "copying": "Copying",
    "ready": "ready",
    "report": "Open the report",
    "compare": "Compare with the drive before the repair",
    "compared": "Before and after",
    "certificate": "Open the certificate",
    "needs_two": "Choose the answer of another drive, before the repair.",
    "cancelled": "Cancelled. Nothing was changed.",
    "lost": "The connection to oncenter is lost. Start it again, and open the page that it opens.",
    "needs_truck": "Choose a truck first.",
    "needs_log": "Drop a log first.",
    "waits": "Wait until all logs are copied.",
    "failed": "No answer",
    "local": "Everything stays on this computer: no log and no answer leaves it.",
}
