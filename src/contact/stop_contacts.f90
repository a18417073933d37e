!> Unilateral contacts as rows over the degrees of freedom. A stop below or above the beam has one contact, a stop on
!> both sides has two.
!>
!> The sign s is 1 for a contact below the beam and -1 for a contact above the beam. The gap is s y - h, with h the
!> height of the contact: s times the coordinate d of its surface. The force acts on the beam along s. The gap between
!> the beam and a body with the coordinate z is s (y - z) - h, and the force acts on the body along -s; the gap between
!> a body and its floor (s = 1) or ceiling (s = -1) is s z - h.
module stop_contacts
   use beam_model, only: beam_model_t
   use kinds, only: wp
   use load_settings, only: start_release
   use measure_list, only: contact_owner_t, owner_of
   use run_settings, only: law_restitution, law_spring_damper, run_settings_t, side_above, side_below, side_both, &
      stop_settings_t, stops_of
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: contact_t, contacts_of, has_one_contact, active_contacts, penetration_tolerance, penetrates
   public :: shape_of_contact, observed_height, height_from_rest, datum_of, force_on_point, owner_of_contact

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
      !> Whether the contact is between the beam and the base: no recorded point takes part
      logical :: is_fixed = .true.
      !> Position and law of the stop, and the parameters of the law
      type(stop_settings_t) :: settings
   end type contact_t

   !> Tolerance of penetration at the start, in units of displacement: greater than rounding errors, less than any
   !> intended penetration.
   real(wp), parameter :: max_penetration = 1.0e-9_wp

   !> Number of keys by which contacts are sorted.
   integer, parameter :: key_count = 9

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

   !> All contacts, in an order independent of that of the scene: along the beam, below before above, the highest first.
   pure function contacts_of(settings) result(contacts)
      type(run_settings_t), intent(in) :: settings
      type(contact_t), allocatable :: contacts(:)

      type(stop_settings_t), allocatable :: stops(:)
      integer :: i, place, side, total

      allocate (stops, source=stops_of(settings))
      allocate (contacts(2*size(stops)))
      total = 0
      do i = 1, size(stops)
         do side = side_below, side_above
            if (all(stops(i)%side /= [side, side_both])) cycle
            total = total + 1
            ! from a stop on both sides the beam is released at the lower contact
            contacts(total) = contact_t(stop=i, number=total, sign=merge(1.0_wp, -1.0_wp, side == side_below), &
               height=stops(i)%preload, is_release_contact=i == settings%release_stop .and. (side == side_below &
               .or. stops(i)%side == side_above), is_fixed=stops(i)%partner == 0, settings=stops(i))
         end do
      end do
      if (total < size(contacts)) contacts = contacts(:total)
      if (total == 1) return
      ! the sort keeps the order of equal keys, so the least significant key comes first
      do i = key_count, 1, -1
         contacts = contacts(ascending_order([(key(contacts(place), i), place=1, total)]))
      end do
   end function contacts_of

   !> Whether each contact is active, [contacts]. Of rigid contacts between the beam and the base at one point and on
   !> one side only the highest is active, and of equally high contacts only that with the maximum coefficient of
   !> restitution. All other contacts are active.
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
            if (.not. (contacts(i)%is_fixed .and. contacts(k)%is_fixed)) cycle
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
            settings%damper_ratio]
      end associate
      value = values(place)
   end function key

   !> Row of a contact: change of its gap per unit of each shape.
   pure function shape_of_contact(contact, model, shapes) result(row)
      type(contact_t), intent(in) :: contact
      type(beam_model_t), intent(in) :: model
      !> Shapes over the degrees of freedom of the model, [degrees of freedom, shapes]
      real(wp), intent(in) :: shapes(:, :)
      real(wp) :: row(size(shapes, 2))

      associate (partner => model%partner_dofs(contact%stop))
         row = contact%sign*shapes(model%stop_dofs(contact%stop), :)
         if (partner > 0) row = row - contact%sign*shapes(partner, :)
      end associate
   end function shape_of_contact

   !> To which stop or body a contact belongs.
   elemental type(contact_owner_t) function owner_of_contact(contact) result(owner)
      type(contact_t), intent(in) :: contact

      associate (partner => contact%settings%partner)
         owner = contact_owner_t(merge(contact%stop, 0, partner == 0), partner, contact%settings%is_of_base, &
            nint(contact%sign), owner_of(contact%stop, partner, contact%settings%is_of_base))
      end associate
   end function owner_of_contact

   !> Force on a recorded point of the model per unit of the force of a contact.
   elemental real(wp) function force_on_point(contact, number) result(force)
      type(contact_t), intent(in) :: contact
      !> Index of the point
      integer, intent(in) :: number

      force = 0.0_wp
      if (contact%settings%partner == number) force = merge(contact%sign, -contact%sign, contact%settings%is_of_base)
   end function force_on_point

   !> Height of a contact surface if recorded points count from z = 0: s times the displacement at which the
   !> gap is zero, which is that of the beam at a stop, of the beam less the body at a body, and of a body at its floor
   !> or ceiling.
   elemental real(wp) function observed_height(contact) result(height)
      type(contact_t), intent(in) :: contact

      height = contact%height + contact%settings%shift_to_zero
   end function observed_height

   !> Height of a contact surface if recorded points count from where their springs have no force.
   elemental real(wp) function height_from_rest(contact) result(height)
      type(contact_t), intent(in) :: contact

      height = contact%height + contact%settings%shift_to_rest
   end function height_from_rest

   !> Zero of the displacement histories of a beam that is released from this contact: the displacement of a fixed
   !> contact surface, else 0.
   elemental real(wp) function datum_of(contact) result(datum)
      type(contact_t), intent(in) :: contact

      datum = merge(contact%sign*contact%height, 0.0_wp, contact%is_fixed)
   end function datum_of

end module stop_contacts
