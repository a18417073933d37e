!> Stops and supports in words.
module stop_words
   use kinds, only: wp
   use number_text, only: rounded
   use quantities, only: units_t, words_in
   use reader_units, only: reading_in
   use run_settings, only: impulse_names, law_names, law_restitution, law_spring_damper, side_above, side_below, &
      side_both, stop_released_from, stop_settings_t
   use scene_types, only: scene_t, support_displacement, support_settings_t
   implicit none (type, external)
   private
   public :: law_in_words, place_in_words, support_in_words, stops_in_scene, released_stop

contains

   !> All stops of a scene in its order.
   pure function stops_in_scene(scene) result(stops)
      type(scene_t), intent(in) :: scene
      type(stop_settings_t), allocatable :: stops(:)

      stops = [scene%stop]
      if (allocated(scene%more_stops)) stops = [stops, scene%more_stops]
   end function stops_in_scene

   !> The stop from which the beam is released, where there are several; 0: there is one.
   pure function released_stop(scene) result(place)
      type(scene_t), intent(in) :: scene
      integer :: place

      place = 0
      if (allocated(scene%more_stops)) place = stop_released_from(stops_in_scene(scene), scene%pulled)
   end function released_stop

   !> The law of a stop with its numbers.
   pure function law_in_words(stop, units) result(words)
      type(stop_settings_t), intent(in) :: stop
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      select case (stop%law)
      case (law_restitution)
         words = trim(law_names(stop%law))//' '//rounded(stop%restitution)//' ('//trim(impulse_names(stop%impulse))//')'
      case (law_spring_damper)
         words = 'spring and damper, '//words_in(units, '{kappa~k} = ') &
            //reading_in(units, 'stiffness', stop%stiffness_ratio)//words_in(units, ', {c*~c} = ') &
            //reading_in(units, 'damper', stop%damper_ratio)
      case default
         words = 'three elements, '//words_in(units, '{kappa~k} = ') &
            //reading_in(units, 'stiffness', stop%stiffness_ratio)//', beta = '//rounded(stop%branch_ratio) &
            //words_in(units, ', {c*~c} = ')//reading_in(units, 'damper', stop%damper_ratio)
      end select
   end function law_in_words

   !> Where a stop is, of one that is not below the beam on which side too.
   pure function place_in_words(stop, node_position, units) result(words)
      type(stop_settings_t), intent(in) :: stop
      !> x/L of the nodes, [0:n]
      real(wp), intent(in), optional :: node_position(0:)
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words, preload

      words = words_in(units, 'at {x/L~x} = ')//reading_in(units, 'length', stop%position)
      preload = words_in(units, ', {delta~d} = ')//reading_in(units, 'displacement', &
         merge(-stop%preload, stop%preload, units%are_of_scene .and. stop%side == side_above))
      if (present(node_position)) then
         if (all(abs(node_position - stop%position) > 0.0_wp)) words = words// &
            ' (so near to the tip that it is put there)'
      end if
      select case (stop%side)
      case (side_below)
         words = words//preload
      case (side_above)
         words = 'above, '//words//preload
      case (side_both)
         words = 'on both sides, '//words//', clearance '//reading_in(units, 'displacement', -stop%preload)
      end select
   end function place_in_words

   !> What a support holds, and where.
   pure function support_in_words(support, units) result(words)
      type(support_settings_t), intent(in) :: support
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = trim(merge('displacement', 'rotation    ', support%motion == support_displacement))
      if (support%stiffness_ratio > 0.0_wp) then
         words = 'spring against '//words//' of '//reading_in(units, trim(merge('stiffness           ', &
            'rotational_stiffness', support%motion == support_displacement)), support%stiffness_ratio)
      else
         words = 'holds the '//words
      end if
      words = words//words_in(units, ', at {x/L~x} = ')//reading_in(units, 'length', support%position)
   end function support_in_words

end module stop_words
