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
    "wheelbase_m_where": "From the first axle to the rear axle; with two rear axles to the middle between them, also "
    "where only one of them is driven. In the registration papers or the body builder's drawing. Usually 3.6 to 3.9 m "
    "for a tractor with two axles, 4 to 6.5 m for a rigid truck. 3,7 m, 370 cm and 3700 mm are the same.",
    "steering_ratio": "Steering ratio",
    "steering_ratio_where": "Degrees of the steering wheel for one degree of the front wheels, in the data sheet of "
    "the steering gear. Usually 16 to 24. 18,5 and 18,5 : 1 are the same.",
    "axle_layout": "Axles",
    "axle_layout_where": "Wheels x driven wheels, in the model name or on the type plate. Filled: driven.",
    "not_known": "I don't know",
    "traffic_side": "Driven on",
    "traffic_side_where": "The side of the road in the country of the drives: roads fall to that side, which moves the "
    "steering wheel.",
    "taken_as": "Taken as",
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
    "limit": "Limit",
    "limit_where": "Recalibrate from this offset on. 2 deg, if the truck's maker gives no other.",
    "applied": "Correction that is already applied",
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
    "truck_is_busy": "Another drive of this truck is being answered: wait, or cancel it.",
    "drives": "Former drives",
    "no_drives": "No drive of this truck is kept yet. Each answer is, and makes the next one more certain.",
    "not_kept": "Drives of an unknown truck or an example are not kept.",
    "no_date": "no date",
    "no_offset": "no offset",
    "together": "Together",
    "drives_since": "drives since",
    "drives_all": "drives",
    "forget": "forget",
    "forget_drive": "Forget this drive? Play and sensor errors that were estimated from it and from later drives are "
    "forgotten, too. The log itself stays where it is.",
    "forget_truck": "Forget this truck",
    "forget_truck_sure": "Forget this truck with its numbers and all its drives?",
    "needs_two": "Choose the answer of another drive, before the repair.",
    "cancelled": "Cancelled. Nothing was changed.",
    "lost": "The connection to oncenter is lost. Start it again, and open the page that it opens.",
    "needs_truck": "Choose a truck first.",
    "needs_log": "Drop a log first.",
    "waits": "Wait until all logs are copied.",
    "failed": "No answer",
    "local": "Everything stays on this computer: no log and no answer leaves it.",
}
