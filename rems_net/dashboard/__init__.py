"""The page that shows a fabric: its server here, its files in `page/`.

The server joins the fabric as a client. It subscribes only while a page is open, and
passes the payloads on as they came; the browser decodes them. `protocol.py` has the
messages between the two.
"""
