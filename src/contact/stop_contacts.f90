!> Unilateral contacts of the beam and of bodies. A stop below or above the beam has one contact, a stop on both sides
!> has two.
!>
!> The sign s is 1 for a contact below the beam and -1 for a contact above the beam. The gap is s y - h, with h the
!> height of the contact: s times the coordinate d of its surface. The force acts on the beam along s. The gap between
!> the beam and a body with the coordinate z is s (y - z) - h, and the force acts on the body along -s; the gap between
!> a body and its floor (s = 1) or ceiling (s = -1) is s z - h.
module stop_contacts
   use kinds, only: wp
   use load_settings, only: start_release
   use run_settings, only: law_restitution, law_spring_damper, run_settings_t, side_above, side_below, side_both, &
      stop_settings_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: contact_t, contacts_of, stops_of, has_one_contact, active_contacts, penetration_tolerance, penetrates
   public :: dofs_of, shape_of_contact, observed_height, height_from_rest, datum_of, force_on_body

   !> A unilateral contact: one side of a stop.
   type :: contact_t
      !> Index of its &stop in the scene (input file)
      integer :: stop = 1
      !> Index among all contacts in the order of the scene, below before above
      integer :: number = 1
      !> Sign s: 1 for a contact below the beam, -1 for a contact above the beam
      real(wp) :: sign = 1.0_wp
      !> Height h = s d of the contact surface in units of displacement: the `preload` of its stop, for both contacts of
      !> a stop on both sides
      real(wp) :: height = 0.0_wp
      !> Whether the beam is released from this contact
      logical :: is_release_contact = .false.
      !> Position and law of the stop, and the parameters of the law
      type(stop_settings_t) :: settings
   end type contact_t

   !> Tolerance of penetration at the start, in units of displacement: greater than rounding errors, less than any
   !> intended penetration.
   real(wp), parameter :: max_penetration = 1.0e-9_wp

   !> Number of keys by which contacts are sorted.
   integer, parameter :: key_count = 10

contains

   !> Maximum penetration at the start that is treated as rounding error and projected onto the contact surface; a start
   !> with a larger penetration is refused.
   elemental real(wp) function penetration_tolerance(contact) result(tolerance)
      type(contact_t), intent(in) :: contact

      tolerance = max_penetration*max(1.0_wp, abs(contact%height))
   end function penetration_tolerance

   !> Whether a start with this gap penetrates the contact by more than the tolerance.
   elemental logical function penetrates(contact, gap) result(answer)
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: gap

      answer = gap < -penetration_tolerance(contact)
   end function penetrates

   !> Whether the run is of the simplest kind, with one contact: a beam without supports along its length, released from
   !> one rigid or three-element stop below the beam, with damping proportional to stiffness, without loads, stresses
   !> and statistics. The contact then needs no histories of its own in the results file, the number of modes can be
   !> chosen by comparing runs, and the stop may have a massless node in front of it.
   pure logical function has_one_contact(settings, supports) result(answer)
      type(run_settings_t), intent(in) :: settings
      !> Number of supports along the beam
      integer, intent(in) :: supports

      answer = supports == 0 .and. settings%has_stop .and. .not. allocated(settings%more_stops) .and. &
         settings%stop%side == side_below .and. settings%stop%law /= law_spring_damper
      answer = answer .and. settings%start%kind == start_release .and. .not. (allocated(settings%forces) .or. &
         allocated(settings%bases) .or. allocated(settings%mode_ratios) .or. settings%zeta_mass > 0.0_wp .or. &
         allocated(settings%stress) .or. allocated(settings%statistics))
   end function has_one_contact

   !> All stops of a run, in the order of the scene.
   pure function stops_of(settings) result(stops)
      type(run_settings_t), intent(in) :: settings
      type(stop_settings_t), allocatable :: stops(:)

      integer :: further

      if (.not. settings%has_stop) then
         allocate (stops(0))
         return
      end if
      further = 0
      if (allocated(settings%more_stops)) further = size(settings%more_stops)
      allocate (stops(1 + further))
      stops(1) = settings%stop
      if (further > 0) stops(2:) = settings%more_stops
   end function stops_of

   !> All contacts, in an order independent of that of the scene: along the beam, below before above, the highest first.
   pure function contacts_of(settings) result(contacts)
      type(run_settings_t), intent(in) :: settings
      type(contact_t), allocatable :: contacts(:)

      type(stop_settings_t), allocatable :: stops(:)
      type(contact_t) :: contact
      integer :: i, place, total

      allocate (stops, source=stops_of(settings))
      allocate (contacts(2*size(stops)))
      total = 0
      do i = 1, size(stops)
         contact = contact_t(stop=i, height=stops(i)%preload, settings=stops(i))
         if (stops(i)%side /= side_above) then
            contact%sign = 1.0_wp
            contact%is_release_contact = i == settings%release_stop
            total = total + 1
            contact%number = total
            contacts(total) = contact
         end if
         if (stops(i)%side /= side_below) then
            contact%sign = -1.0_wp
            ! from a stop on both sides the beam is released at the lower contact
            contact%is_release_contact = i == settings%release_stop .and. stops(i)%side /= side_both
            total = total + 1
            contact%number = total
            contacts(total) = contact
         end if
      end do
      contacts = contacts(:total)
      ! the sort keeps the order of equal keys, so the least significant key comes first
      do i = key_count, 1, -1
         contacts = contacts(ascending_order([(key(contacts(place), i), place=1, total)]))
      end do
   end function contacts_of

   !> Whether each contact is active, [contacts]. Of rigid contacts between the beam and the base at one point and on
   !> one side only the highest is active, and of equally high contacts only that with the maximum coefficient of
   !> restitution. All compliant contacts, and all contacts of bodies, are active.
   pure function active_contacts(contacts, dofs) result(is_active)
      type(contact_t), intent(in) :: contacts(:)
      !> Degree of freedom of each contact
      integer, intent(in) :: dofs(:)
      logical :: is_active(size(contacts))

      real(wp) :: difference
      integer :: i, k

      is_active = .true.
      do k = 1, size(contacts)
         do i = 1, size(contacts)
            if (i == k .or. dofs(i) /= dofs(k) .or. contacts(i)%sign*contacts(k)%sign < 0.0_wp) cycle
            if (max(contacts(i)%settings%body, contacts(k)%settings%body) > 0) cycle
            if (any([contacts(i)%settings%law, contacts(k)%settings%law] /= law_restitution)) cycle
            difference = contacts(i)%height - contacts(k)%height
            if (.not. abs(difference) > 0.0_wp) then
               difference = contacts(i)%settings%restitution - contacts(k)%settings%restitution
            end if
            if (difference > 0.0_wp .or. (.not. abs(difference) > 0.0_wp .and. i < k)) is_active(k) = .false.
         end do
      end do
   end function active_contacts

   !> A key by which contacts are sorted. Identical contacts remain in the order of the scene.
   pure real(wp) function key(contact, place) result(value)
      type(contact_t), intent(in) :: contact
      !> 1: the most significant key
      integer, intent(in) :: place

      real(wp) :: values(key_count)

      associate (settings => contact%settings)
         values = [settings%position, -contact%sign, -contact%height, real(settings%law, wp), &
            real(settings%impulse, wp), -settings%restitution, settings%stiffness_ratio, settings%branch_ratio, &
            settings%damper_ratio, real(settings%body, wp)]
      end associate
      value = values(place)
   end function key

   !> Degrees of freedom of a contact: its gap changes by s per unit of the first, and by -s per unit of the second. The
   !> degrees of freedom of bodies follow those of the beam.
   pure function dofs_of(contact, dof, order) result(dofs)
      type(contact_t), intent(in) :: contact
      !> Degree of freedom of the beam at the contact
      integer, intent(in) :: dof
      !> Number of degrees of freedom of the beam
      integer, intent(in) :: order
      !> The second is 0 if the partner of the first is fixed
      integer :: dofs(2)

      dofs = [dof, 0]
      associate (settings => contact%settings)
         if (settings%body == 0) return
         dofs = [dof, order + settings%body]
         if (settings%is_of_base) dofs = [order + settings%body, 0]
      end associate
   end function dofs_of

   !> Row of a contact: change of its gap per unit of each shape.
   pure function shape_of_contact(contact, dof, order, shapes) result(row)
      type(contact_t), intent(in) :: contact
      !> Degree of freedom of the beam at the contact
      integer, intent(in) :: dof
      !> Number of degrees of freedom of the beam
      integer, intent(in) :: order
      !> Shapes over the degrees of freedom of the beam, followed by those of the bodies, [degrees of freedom, shapes]
      real(wp), intent(in) :: shapes(:, :)
      real(wp) :: row(size(shapes, 2))

      integer :: dofs(2)

      dofs = dofs_of(contact, dof, order)
      row = contact%sign*shapes(dofs(1), :)
      if (dofs(2) > 0) row = row - contact%sign*shapes(dofs(2), :)
   end function shape_of_contact

   !> Force on a body, positive upwards, per unit of the force of a contact.
   elemental real(wp) function force_on_body(contact, body) result(force)
      type(contact_t), intent(in) :: contact
      !> Number of the body
      integer, intent(in) :: body

      force = 0.0_wp
      if (contact%settings%body == body) force = merge(contact%sign, -contact%sign, contact%settings%is_of_base)
   end function force_on_body

   !> Height of a contact surface if coordinates of bodies count from z = 0: s times the displacement at which the gap
   !> is zero, which is that of the beam at a stop, of the beam less the body at a body, and of a body at its floor or
   !> ceiling.
   elemental real(wp) function observed_height(contact) result(height)
      type(contact_t), intent(in) :: contact

      associate (settings => contact%settings)
         height = contact%height + merge(contact%sign, -contact%sign, settings%is_of_base)*settings%origin
      end associate
   end function observed_height

   !> Height of a contact surface if coordinates of bodies count from where their springs have no force.
   elemental real(wp) function height_from_rest(contact) result(height)
      type(contact_t), intent(in) :: contact

      associate (settings => contact%settings)
         height = observed_height(contact) - merge(contact%sign, -contact%sign, settings%is_of_base)*settings%rest
      end associate
   end function height_from_rest

   !> Zero of the displacement histories of a beam that is released from this contact: the displacement of the contact
   !> surface; 0 at a contact of a body.
   elemental real(wp) function datum_of(contact) result(datum)
      type(contact_t), intent(in) :: contact

      datum = 0.0_wp
      if (contact%settings%body == 0) datum = contact%sign*contact%height
   end function datum_of

end module stop_contacts
